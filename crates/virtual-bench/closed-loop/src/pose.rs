//! Poses: a calibration of them on a mirror with an instrument that reads piston and tilts, and what they reach.

use calibration::{PlatePose, PoseError, PosePoint, Posed, Reach, posed, poses_to_measure};
use control_core::calibration::{Parts, Plate};
use control_core::{Calibration, Micrometre, Setpoint};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::{ConfigError, MirrorConfig, Reading, Sensor};

use crate::{Loop, TICK_S, core_pose};

/// A pose is held so long before it is read (s): as positions are that correct tables.
const HELD_S: f64 = 2.0;
/// Readings of which the mean is taken, one a tick.
const READINGS: usize = 100;
/// Lever that is assumed until it is measured (um): that of plates of half a millimetre.
const ASSUMED_LEVER: Micrometre = Micrometre(500.0);

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
        calibration: assumed(calibration),
        piston_rms_um: f64::NAN,
        tilt_rms_rad: f64::NAN,
    };
    for _ in 0..rounds {
        let points = measured(&found.calibration, config)?;
        found = posed(&found.calibration, &points)?;
    }
    Ok(found)
}

/// With levers to begin with, where there are none.
fn assumed(calibration: &Calibration) -> Calibration {
    let parts = calibration.parts();
    if parts.plate.is_known() {
        return *calibration;
    }
    Calibration::new(Parts {
        plate: Plate::cross(ASSUMED_LEVER),
        ..*parts
    })
    .expect("levers of a square plate are levers")
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
    let mut sensor = Sensor::new(config);
    let point = |asked: PlatePose| {
        mirror.hold_pose(&asked, HELD_S);
        let mut sum = Reading::default();
        for _ in 0..READINGS {
            mirror.tick(Setpoint::Position(core_pose(&asked)));
            let read = sensor.read(&mirror.mirror().state(), TICK_S);
            sum.z_um += read.z_um;
            sum.tilt_x_deg += read.tilt_x_deg;
            sum.tilt_y_deg += read.tilt_y_deg;
        }
        let mean = |sum: f64| sum / READINGS as f64;
        PosePoint {
            asked,
            reached: PlatePose {
                z_um: mean(sum.z_um),
                tilt_x_rad: mean(sum.tilt_x_deg).to_radians(),
                // The virtual mirror counts this one left-handed.
                tilt_y_rad: -mean(sum.tilt_y_deg).to_radians(),
            },
        }
    };
    Ok(poses_to_measure(&reach, top_um)
        .into_iter()
        .map(point)
        .collect())
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

/// What random poses are off by at rest: all over the pistons, with tilts up to a part of the largest.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn pose_errors(
    calibration: &Calibration,
    config: &MirrorConfig,
    poses: usize,
    part: f64,
) -> Result<PoseErrors, ConfigError> {
    let (reach, top_um) = reach(calibration);
    let mut used = *calibration;
    let mut mirror = Loop::new(&mut used, config)?;
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let (mut piston, mut tilt, mut largest) = (0.0, 0.0, 0.0_f64);
    for _ in 0..poses {
        let z_um = rng.random_range(0.03..1.0) * top_um;
        let (sine, cosine) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let rad = part * rng.random_range(0.0..1.0) * reach.largest_tilt_rad(z_um, (cosine, sine));
        let asked = PlatePose {
            z_um,
            tilt_x_rad: rad * cosine,
            tilt_y_rad: rad * sine,
        };
        let reached = mirror.hold_pose(&asked, HELD_S);
        piston += (reached.z_um - asked.z_um).powi(2);
        for off in [
            reached.tilt_x_rad - asked.tilt_x_rad,
            reached.tilt_y_rad - asked.tilt_y_rad,
        ] {
            tilt += 0.5 * off * off;
            largest = largest.max(off.abs());
        }
    }
    let rms = |sum: f64| (sum / poses as f64).sqrt();
    Ok(PoseErrors {
        piston_rms_um: rms(piston),
        tilt_rms_deg: rms(tilt).to_degrees(),
        tilt_largest_deg: largest.to_degrees(),
    })
}
