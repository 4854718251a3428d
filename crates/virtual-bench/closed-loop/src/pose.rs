//! Poses: a calibration of them on a mirror with an instrument that reads piston and tilts, and what they reach.

use std::array;

use calibration::{
    COURSE_S, COURSE_STEP_S, Drives, PlatePose, PoseError, PosePoint, Posed, Reach, along_a_course,
    posed, poses_to_measure, with_assumed_levers,
};
use control_core::{
    CHANNELS, Calibration, Estimate, Limit, Limits, Micrometre, Setpoint, Uncertainty,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::{ConfigError, MirrorConfig, Reading, Sensor};

use crate::surroundings::Around;
use crate::{Loop, TICK_S, core_pose};

/// A pose is held so long before it is read (s): as positions are that correct tables.
const HELD_S: f64 = 2.0;
/// Readings of which the mean is taken, one a tick.
const READINGS: usize = 100;

/// Why poses could not be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum PoseCalibrationError {
    /// It is not a mirror.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No plate moves like this.
    #[error(transparent)]
    Pose(#[from] PoseError),
}

/// Tilts of a mirror (deg).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tilts {
    /// Where it was (um).
    pub z_um: f64,
    /// About the x axis.
    pub x_deg: f64,
    /// About the y axis.
    pub y_deg: f64,
}

/// What poses are off by.
#[derive(Clone, Copy, Debug)]
pub struct PoseErrors {
    /// Root mean square of the pistons' (um).
    pub piston_rms_um: f64,
    /// Root mean square of the tilts', about both axes (deg).
    pub tilt_rms_deg: f64,
    /// The largest of the tilts' (deg).
    pub tilt_largest_deg: f64,
    /// Poses that a limit held elsewhere, by name, which are not counted.
    pub limited: usize,
}

/// `calibration` with levers and each actuator's own tables, from poses that are measured under it, and once more under what
/// comes out of that.
///
/// # Errors
/// Where a number of `config` is out of range, or no plate moves like what was measured.
pub fn calibrate_pose(
    calibration: &Calibration,
    config: &MirrorConfig,
    rounds: usize,
) -> Result<Posed, PoseCalibrationError> {
    let mut found = Posed {
        calibration: with_assumed_levers(calibration),
        piston_rms_um: f64::NAN,
        tilt_rms_rad: f64::NAN,
        zero: PlatePose::default(),
        left_out: Vec::new(),
        turned_rad: 0.0,
    };
    for _ in 0..rounds {
        let points = measured(&found.calibration, config)?;
        found = posed(&found.calibration, &points)?;
    }
    Ok(found)
}

fn reach(calibration: &Calibration) -> (Reach, f64) {
    let top_um = experiments::calibration::RANGE * f64::from(calibration.max_position().0);
    (Reach::new(calibration.parts().plate, top_um), top_um)
}

/// The poses that tell levers and shapes, as an instrument reads them.
fn measured(
    calibration: &Calibration,
    config: &MirrorConfig,
) -> Result<Vec<PosePoint>, ConfigError> {
    let (reach, top_um) = reach(calibration);
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    // Heat of a neighbour that the calibration does not know yet would be taken for a warm room.
    mirror.compensate_surroundings(false);
    let mut sensor = Sensor::new(config);
    let mut points: Vec<_> = poses_to_measure(calibration, top_um)
        .into_iter()
        .map(|asked| {
            mirror.hold_pose(&asked, HELD_S);
            let setpoint = Setpoint::Position(core_pose(&asked));
            let mut read = Readings::default();
            for _ in 0..READINGS {
                read.tick(&mut mirror, &mut sensor, setpoint);
            }
            PosePoint {
                asked,
                held_s: HELD_S + READINGS as f64 * TICK_S,
                reached: read.mean(),
                told_k: read.told_k(),
            }
        })
        .collect();
    // From where the course begins.
    let begin = along_a_course(&reach, top_um, 0.0);
    mirror.hold_pose(&begin, HELD_S);
    points.push(PosePoint {
        asked: begin,
        held_s: HELD_S,
        reached: None,
        told_k: None,
    });
    for step in 1..=(COURSE_S / COURSE_STEP_S).round() as usize {
        let mut read = Readings::default();
        let mut asked = begin;
        for tick in 1..=(COURSE_STEP_S / TICK_S).round() as usize {
            let t_s = (step - 1) as f64 * COURSE_STEP_S + tick as f64 * TICK_S;
            asked = along_a_course(&reach, top_um, t_s);
            read = Readings::default();
            read.tick(&mut mirror, &mut sensor, Setpoint::Track(core_pose(&asked)));
        }
        points.push(PosePoint {
            asked,
            held_s: COURSE_STEP_S,
            reached: read.mean(),
            told_k: None,
        });
    }
    Ok(points)
}

/// What an instrument read in a row, as long as no limit acted.
#[derive(Default)]
struct Readings {
    sum: Reading,
    told_k: [f64; CHANNELS],
    count: f64,
    limits: Limits,
}

impl Readings {
    fn tick(&mut self, mirror: &mut Loop, sensor: &mut Sensor, setpoint: Setpoint) {
        let (_, limits) = mirror.tick(setpoint);
        let read = sensor.read(&mirror.mirror().state(), TICK_S);
        self.sum.z_um += read.z_um;
        self.sum.tilt_x_deg += read.tilt_x_deg;
        self.sum.tilt_y_deg += read.tilt_y_deg;
        let told_k = mirror.sensed_k();
        self.told_k = array::from_fn(|i| self.told_k[i] + told_k[i].unwrap_or(f64::NAN));
        self.count += 1.0;
        self.limits = self.limits.union(limits);
    }

    /// What the resistances told in the mean, where all of them told something each time.
    fn told_k(&self) -> Option<[f64; CHANNELS]> {
        let mean = self.told_k.map(|sum| sum / self.count);
        mean.iter().all(|told| told.is_finite()).then_some(mean)
    }

    fn mean(&self) -> Option<PlatePose> {
        let mean = |sum: f64| sum / self.count;
        (!self.limits.hold_back()).then(|| PlatePose {
            z_um: mean(self.sum.z_um),
            tilt_x_rad: mean(self.sum.tilt_x_deg).to_radians(),
            // The virtual mirror counts this one left-handed.
            tilt_y_rad: -mean(self.sum.tilt_y_deg).to_radians(),
        })
    }
}

/// The tilts of a mirror that is asked to be level, at rest from 0 to 170 um, or to the top of its range.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn level_tilts(
    calibration: &Calibration,
    config: &MirrorConfig,
    positions: usize,
) -> Result<Vec<Tilts>, ConfigError> {
    let top_um = reach(calibration).1.min(170.0);
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    let at = |position: usize| {
        let asked = PlatePose {
            z_um: top_um * position as f64 / (positions - 1) as f64,
            ..PlatePose::default()
        };
        let reached = mirror.hold_pose(&asked, HELD_S);
        Tilts {
            z_um: asked.z_um,
            x_deg: reached.tilt_x_rad.to_degrees(),
            y_deg: reached.tilt_y_rad.to_degrees(),
        }
    };
    Ok((0..positions).map(at).collect())
}

/// The tilts of a mirror that is asked to be level along the third period of a sine of its piston.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn tilts_along_a_sine(
    calibration: &Calibration,
    config: &MirrorConfig,
    (low_um, high_um): (f64, f64),
    hz: f64,
) -> Result<(Vec<Tilts>, Limits), ConfigError> {
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    mirror.hold(low_um, HELD_S);
    let period = (1.0 / (hz * TICK_S)).round() as usize;
    let mut limits = Limits::NONE;
    let mut tilts = Vec::with_capacity(period);
    for tick in 1..=3 * period {
        let at = |tick: f64| {
            let phase = std::f64::consts::TAU * tick / period as f64;
            0.5 * (low_um + high_um) - 0.5 * (high_um - low_um) * phase.cos()
        };
        let (z_um, ahead) = (at(tick as f64), f64::from(mirror.track_delay_ticks()));
        let asked = Micrometre(at(tick as f64 + ahead) as f32);
        let (_, acted) = mirror.tick(Setpoint::track(asked));
        limits = limits.union(acted);
        if tick > 2 * period {
            let state = mirror.mirror().state();
            tilts.push(Tilts {
                z_um,
                x_deg: state.tilt_x_deg,
                y_deg: -state.tilt_y_deg,
            });
        }
    }
    Ok((tilts, limits))
}

/// From the lowest to the highest of each tilt, the larger of the two (deg).
pub fn peak_to_peak_deg(tilts: &[Tilts]) -> f64 {
    let spread = |of: fn(&Tilts) -> f64| {
        let (low, high) = tilts
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), deg| {
                (low.min(deg), high.max(deg))
            });
        high - low
    };
    spread(|tilts| tilts.x_deg).max(spread(|tilts| tilts.y_deg))
}

/// A random pose that was asked for.
#[derive(Clone, Copy, Debug)]
pub struct ReachedPose {
    /// Where to.
    pub asked: PlatePose,
    /// How far from there the plate came to rest.
    pub off: PlatePose,
    /// What acted in the end.
    pub limits: Limits,
    /// How far off the core said that it may be.
    pub told: Option<Uncertainty>,
    /// What the core knew of its surroundings.
    pub known: Option<Estimate>,
}

impl ReachedPose {
    /// Whether either tilt is off by more than the core said that it may be.
    pub fn is_tilt_missed(&self) -> bool {
        let told = self.told.map_or(0.0, |told| f64::from(told.tilt.0));
        self.off.tilt_x_rad.abs().max(self.off.tilt_y_rad.abs()) > told
    }
}

/// Random poses that the drives hold, one after the other, each held for two seconds: all over the pistons, with tilts up to a part of the
/// largest.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn random_poses(
    calibration: &Calibration,
    config: &MirrorConfig,
    poses: (usize, f64),
    around: Around,
) -> Result<Vec<ReachedPose>, ConfigError> {
    held_for(HELD_S, calibration, config, poses, around)
}

/// The same, each held for so long.
fn held_for(
    seconds: f64,
    calibration: &Calibration,
    config: &MirrorConfig,
    (poses, part): (usize, f64),
    around: Around,
) -> Result<Vec<ReachedPose>, ConfigError> {
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    mirror.surround(around);
    let asked = held_poses(calibration, config.seed, part).take(poses);
    let reached = asked.map(|asked| reached_pose(&mut mirror, asked, seconds));
    Ok(reached.collect())
}

fn reached_pose(mirror: &mut Loop, asked: PlatePose, seconds: f64) -> ReachedPose {
    let reached = mirror.hold_pose(&asked, seconds);
    let (_, limits) = mirror.tick(Setpoint::Position(core_pose(&asked)));
    ReachedPose {
        asked,
        off: PlatePose {
            z_um: reached.z_um - asked.z_um,
            tilt_x_rad: reached.tilt_x_rad - asked.tilt_x_rad,
            tilt_y_rad: reached.tilt_y_rad - asked.tilt_y_rad,
        },
        limits,
        told: mirror.uncertainty(),
        known: mirror.surroundings(),
    }
}

/// Directions of the edge's tilts, and parts of the range of the pistons that they are about: an outline of `host-tool range` has more.
const DIRECTIONS: usize = 12;
const PARTS: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];
/// Poses of the edge are asked for in steps of so many: a neighbour in time is far away, and all have their turn (it divides none of their number).
const STRIDE: usize = 23;

/// Poses at a part of the largest tilts that `host-tool range` tells in these surroundings, one after the other, each held until shared heat has
/// come to rest and creep has let go of where the mirror was before: every `every`th of those around the whole edge.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn edge_poses(
    calibration: &Calibration,
    config: &MirrorConfig,
    (every, part): (usize, f64),
    around: Around,
) -> Result<Vec<ReachedPose>, ConfigError> {
    /// Of a pole of 4.3 s, by which the paper's mirror shares most of its heat that is slow, 1 % is left then.
    const STAY_S: f64 = 20.0;
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    mirror.surround(around);
    let top_um = f64::from(calibration.max_position().0);
    if around != Around::CALIBRATION {
        // A board that has been used knows its room.
        for part in [0.4, 0.8] {
            mirror.hold(part * top_um, HELD_S);
        }
    }
    let drives = Drives::new(calibration.parts());
    let held = Reach::new(calibration.parts().plate, top_um)
        .above(mirror.lowest_um())
        .held_by(match mirror.surroundings() {
            Some(estimate) if around != Around::CALIBRATION => drives.around(&estimate),
            _ => drives,
        });
    let (low_um, high_um) = held.level_um();
    let count = DIRECTIONS * PARTS.len();
    let asked = (0..count).step_by(every).map(|step| {
        let place = step * STRIDE % count;
        let z_um = low_um + PARTS[place / DIRECTIONS] * (high_um - low_um);
        let turn = (place % DIRECTIONS) as f64 / DIRECTIONS as f64;
        let (sine, cosine) = (std::f64::consts::TAU * turn).sin_cos();
        let rad = part * held.largest_tilt_rad(z_um, (cosine, sine));
        PlatePose {
            z_um,
            tilt_x_rad: rad * cosine,
            tilt_y_rad: rad * sine,
        }
    });
    Ok(asked
        .map(|asked| reached_pose(&mut mirror, asked, STAY_S))
        .collect())
}

impl PoseErrors {
    /// Of those that no limit held elsewhere.
    pub fn of(poses: &[ReachedPose]) -> Self {
        let held: Vec<_> = poses
            .iter()
            .filter(|pose| !pose.limits.hold_back())
            .map(|pose| pose.off)
            .collect();
        let rms = |squares: f64| (squares / held.len() as f64).sqrt();
        let tilts = || held.iter().flat_map(|off| [off.tilt_x_rad, off.tilt_y_rad]);
        Self {
            piston_rms_um: rms(held.iter().map(|off| off.z_um.powi(2)).sum()),
            tilt_rms_deg: rms(tilts().map(|off| 0.5 * off * off).sum()).to_degrees(),
            tilt_largest_deg: tilts().map(f64::abs).fold(0.0, f64::max).to_degrees(),
            limited: poses.len() - held.len(),
        }
    }
}

/// How often `calibration-drifted` is told of a mirror that has not changed, at random poses that the drives hold, one after the other, with tilts
/// up to a part of the largest.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn alarms(
    calibration: &Calibration,
    config: &MirrorConfig,
    poses: usize,
    part: f64,
) -> Result<usize, ConfigError> {
    /// Twice what an evidence of three deviations takes to be told.
    const STAY_S: f64 = 5.0;
    let around = Around::CALIBRATION;
    let reached = held_for(STAY_S, calibration, config, (poses, part), around)?;
    let told = |pose: &&ReachedPose| pose.limits.contains(Limit::CalibrationDrifted);
    Ok(reached.iter().filter(told).count())
}

/// Random poses that `set-pose` takes, with tilts up to a part of the largest.
fn held_poses(calibration: &Calibration, seed: u64, part: f64) -> impl Iterator<Item = PlatePose> {
    let (reach, top_um) = reach(calibration);
    let held = reach.clone().held_by(Drives::new(calibration.parts()));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    std::iter::repeat_with(move || random_pose(&mut rng, &reach, top_um, part))
        .filter(move |pose| held.contains(pose))
}

/// Anywhere on the pistons but next to rest, tilted any way by up to a part of the largest tilt.
fn random_pose(rng: &mut ChaCha8Rng, reach: &Reach, top_um: f64, part: f64) -> PlatePose {
    let z_um = rng.random_range(0.03..1.0) * top_um;
    let (sine, cosine) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let rad = part * rng.random_range(0.0..1.0) * reach.largest_tilt_rad(z_um, (cosine, sine));
    PlatePose {
        z_um,
        tilt_x_rad: rad * cosine,
        tilt_y_rad: rad * sine,
    }
}
