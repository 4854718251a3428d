//! What becomes of a calibration while its mirror ages, and of one that stays true while its surroundings move.

use calibration::PlatePose;
use control_core::{Calibration, Limit, Limits, Setpoint};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::{ConfigError, MirrorConfig};

use crate::core_pose;
use crate::{Loop, TICK_S};

/// Parts of the range at which an ageing mirror is used, again and again.
const PLACES: [f64; 4] = [0.35, 0.9, 0.15, 0.65];
/// So long each is held (s).
const STAY_S: f64 = 1.2;
/// A mirror that has aged by so many steps is another one.
const MOST_STEPS: u32 = 30;

/// What changes in one actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ageing {
    /// The heater's resistance.
    Resistance,
    /// The film's temperature coefficient.
    Coefficient,
    /// The loss to the air.
    Loss,
    /// How far it bends for a kelvin, without anything that a heater could tell.
    Bend,
}

/// How one actuator ages.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// What changes.
    pub ageing: Ageing,
    /// In which actuator.
    pub actuator: usize,
    /// By how much in a step, as a part of it; the mirror is used for 5 s from step to step.
    pub step: f64,
    /// How much warmer the room is than at calibration (K).
    pub room_k: f64,
}

/// What became of it.
#[derive(Clone, Copy, Debug)]
pub struct Aged {
    /// The largest error of the piston before `calibration-drifted` was told (um).
    pub error_um: f64,
    /// The change at which it was told, as a part; `None`: never.
    pub told_at: Option<f64>,
}

/// Lets a calibrated mirror age until that is told.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn aged(
    calibration: &mut Calibration,
    config: &MirrorConfig,
    course: &Course,
) -> Result<Aged, ConfigError> {
    let top_um = f64::from(calibration.max_position().0).min(170.0);
    let mut mirror = Loop::new(calibration, config)?;
    mirror.set_ambient(course.room_k);
    let mut error_um = 0.0_f64;
    for step in 1..=MOST_STEPS {
        let change = course.step * f64::from(step);
        mirror.age(&with(config, course, change))?;
        for place in PLACES {
            let z_um = place * top_um;
            let off_um = mirror.hold(z_um, STAY_S) - z_um;
            let level = PlatePose {
                z_um,
                ..PlatePose::default()
            };
            if is_told(mirror.tick(Setpoint::Position(core_pose(&level))).1) {
                return Ok(Aged {
                    error_um,
                    told_at: Some(change),
                });
            }
            error_um = error_um.max(off_um.abs());
        }
    }
    Ok(Aged {
        error_um,
        told_at: None,
    })
}

fn is_told(limits: Limits) -> bool {
    limits.contains(Limit::CalibrationDrifted)
}

/// The mirror, changed by this part.
fn with(config: &MirrorConfig, course: &Course, change: f64) -> MirrorConfig {
    let mut config = config.clone();
    let trims = match course.ageing {
        Ageing::Resistance => &mut config.trim.ohm,
        Ageing::Coefficient => &mut config.trim.tcr,
        Ageing::Loss => &mut config.trim.air_loss,
        Ageing::Bend => &mut config.trim.bend,
    };
    trims[course.actuator] *= 1.0 + change;
    config
}

/// How often a calibration that is true is doubted.
#[derive(Clone, Copy, Debug)]
pub struct Doubted {
    /// Times that `calibration-drifted` began to be told.
    pub alarms: u32,
    /// How near it came, as a part of what is told.
    pub nearest: f32,
}

/// Ordinary use of a mirror that does not age: moves and rests of a fifth of a second to five, tilts, waveforms, and a room
/// and an air that move.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn doubted(
    calibration: &mut Calibration,
    config: &MirrorConfig,
    (seconds, seed): (f64, u64),
) -> Result<Doubted, ConfigError> {
    let top_um = f64::from(calibration.max_position().0).min(170.0);
    let tilt_rad = 0.2 * top_um / config.plate.lever_um;
    let mut mirror = Loop::new(calibration, config)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut doubted = Doubted {
        alarms: 0,
        nearest: 0.0,
    };
    let (mut spent_s, mut was_told, mut room_k) = (0.0, false, 0.0_f64);
    while spent_s < seconds {
        // A room of 10 to 40 degC around 22 that drifts, and now and then is another one; air that now and then flows.
        room_k = (room_k + rng.random_range(-0.5..0.5)).clamp(-12.0, 18.0);
        if rng.random_bool(0.03) {
            room_k = rng.random_range(-12.0..18.0);
        }
        mirror.set_ambient(room_k);
        if rng.random_bool(0.05) {
            mirror.set_air_loss(rng.random_range(0.8..1.2));
        }
        let stay_s = 10.0_f64.powf(rng.random_range(-0.7..0.7));
        let mut pose = PlatePose {
            z_um: rng.random_range(0.0..top_um),
            ..PlatePose::default()
        };
        if rng.random_bool(0.5) {
            pose.tilt_x_rad = rng.random_range(-tilt_rad..tilt_rad);
            pose.tilt_y_rad = rng.random_range(-tilt_rad..tilt_rad);
        }
        let (z_um, is_wave) = (pose.z_um, rng.random_bool(0.2));
        let hz = 10.0_f64.powf(rng.random_range(-1.0..2.0));
        let amplitude_um = z_um.min(top_um - z_um) * rng.random_range(0.0..1.0);
        for tick in 0..(stay_s / TICK_S) as usize {
            let setpoint = if is_wave {
                let angle = std::f64::consts::TAU * hz * tick as f64 * TICK_S;
                pose.z_um = z_um + amplitude_um * angle.sin();
                Setpoint::Track(core_pose(&pose))
            } else {
                Setpoint::Position(core_pose(&pose))
            };
            let told = is_told(mirror.tick(setpoint).1);
            doubted.alarms += u32::from(told && !was_told);
            was_told = told;
            doubted.nearest = doubted.nearest.max(mirror.drift());
        }
        spent_s += stay_s;
    }
    Ok(doubted)
}
