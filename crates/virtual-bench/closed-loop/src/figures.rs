//! What positioning reaches, measured on a mirror.

use control_core::resistance::PROBE_DRIVE;
use control_core::{Calibration, Limit, Limits, Micrometre, Setpoint};
use emulated_board::{Device, Mirror};
use virtual_mirror::ConfigError;

use crate::sine::Sine;
use crate::{Loop, TICK_S, limit};

/// A loop.
#[derive(Clone, Copy, Debug)]
pub struct Width {
    /// Largest difference between the two ways through one position (um).
    pub width_um: f64,
    /// What acted meanwhile.
    pub limits: Limits,
    /// Where a mirror cannot cool as fast as it is asked to.
    pub cooling: Option<Cooling>,
}

/// A loop that is open because the mirror cannot cool as fast.
#[derive(Clone, Copy, Debug)]
pub struct Cooling {
    /// Width that the ideal controller leaves, which knows the mirror and is where it is asked to be whenever a drive from none
    /// to the highest takes it there (um). It bounds the error, not the width: a controller that is late on the way up, too,
    /// has a narrower loop.
    pub ideal_um: f64,
    /// The part of the span, its upper end kept, that the ideal controller follows without a loop.
    pub share: f64,
    /// Width of the loop over that part (um).
    pub width_um: f64,
}

/// Errors at rest (um).
#[derive(Clone, Copy, Debug)]
pub struct Static {
    /// Root mean square.
    pub rms_um: f64,
    /// Largest.
    pub largest_um: f64,
    /// Positions at which the mirror was still too warm with no more driven than a probe, and the board said so; no error is counted there.
    pub too_warm: usize,
}

impl Static {
    /// How many positions do not count, where any, to be put behind an error.
    pub fn left_out(&self) -> String {
        match self.too_warm {
            0 => String::new(),
            count => format!(", {count} too warm"),
        }
    }
}

/// A step from one position to another.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Where it began (um).
    pub from_um: f64,
    /// Where it was to end (um).
    pub to_um: f64,
    /// Until it stayed within 5 % of the step (s).
    pub t95_s: f64,
    /// The same with the highest drive, or with none, all the way: no controller is faster (s).
    pub limit_s: f64,
    /// Furthest beyond its end, in parts of the step.
    pub overshoot: f64,
    /// What acted on the way.
    pub limits: Limits,
}

/// Static errors from 2 % of the range to its end, the top or 170 um, at positions that no calibration was corrected at, of a mirror that was at rest.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn at_rest(calibration: &mut Calibration, config: &impl Device) -> Result<Static, ConfigError> {
    Ok(next_moves(&mut Loop::new(calibration, config)?))
}

/// The same from whatever a mirror has done before.
pub fn next_moves(mirror: &mut Loop<'_, impl Mirror>) -> Static {
    const POSITIONS: u32 = 17;
    const LOWEST: f64 = 0.37;
    const STAY_S: f64 = 1.5;
    let top_um = f64::from(mirror.calibration().max_position().0).min(170.0);
    // A stride that shares no factor with their number: up and down, far and near.
    let errors: Vec<f64> = (0..POSITIONS)
        .filter_map(|i| {
            let place = f64::from(i * 5 % POSITIONS) + LOWEST;
            let z_um = top_um * place / (f64::from(POSITIONS - 1) + LOWEST);
            let error_um = mirror.hold(z_um, STAY_S) - z_um;
            (!is_too_warm(mirror, z_um)).then_some(error_um)
        })
        .collect();
    Static {
        rms_um: rms(&errors),
        largest_um: largest(&errors),
        too_warm: POSITIONS as usize - errors.len(),
    }
}

/// Whether the next tick drives no more than what a probe does, and the board says that the mirror is still too warm for `z_um`: heaters
/// cannot cool.
fn is_too_warm(mirror: &mut Loop<'_, impl Mirror>, z_um: f64) -> bool {
    let (_, limits) = mirror.tick(Setpoint::position(Micrometre(z_um as f32)));
    let least_v = f64::from(PROBE_DRIVE.0);
    limits.contains(Limit::Cooling) && mirror.drive_v().iter().all(|&v| v <= least_v)
}

/// Steps between pairs of positions, after a second at the first.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn steps(
    calibration: &mut Calibration,
    config: &impl Device,
    pairs: &[(f64, f64)],
) -> Result<Vec<Step>, ConfigError> {
    let drive_v = f64::from(calibration.max_drive().0);
    let mut mirror = Loop::new(calibration, config)?;
    Ok(pairs
        .iter()
        .map(|&(from_um, to_um)| {
            mirror.hold(from_um, 1.0);
            let limit_s = limit::fastest_s(mirror.mirror(), drive_v, from_um, to_um);
            let mut limits = Limits::NONE;
            let setpoint = Setpoint::position(Micrometre(to_um as f32));
            let course: Vec<f64> = (0..(1.0 / TICK_S) as usize)
                .map(|_| {
                    let (z, acted) = mirror.tick(setpoint);
                    limits = limits.union(acted);
                    z
                })
                .collect();
            let size = to_um - from_um;
            let end = course[course.len() - 500..].iter().sum::<f64>() / 500.0;
            let away = |z: &f64| (z - end) / size;
            let out = course.iter().rposition(|z| away(z).abs() > 0.05);
            let beyond = course.iter().map(away).fold(0.0, f64::max);
            Step {
                from_um,
                to_um,
                t95_s: out.map_or(0.0, |last| (last + 1) as f64 * TICK_S),
                limit_s,
                overshoot: beyond,
                limits,
            }
        })
        .collect())
}

/// The furthest that the mirror moves from where it is a second after a step, in the half minute after
/// that, in parts of the step.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn creep(
    calibration: &mut Calibration,
    config: &impl Device,
    (from_um, to_um): (f64, f64),
) -> Result<f64, ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    mirror.hold(from_um, 10.0);
    let first = mirror.hold(to_um, 1.0);
    let crept = (0..58).map(|_| mirror.hold(to_um, 0.5) - first);
    let furthest = crept.map(f64::abs).fold(0.0, f64::max);
    Ok(furthest / (to_um - from_um).abs())
}

/// The loop in the third period of a sine between two positions that starts at the lower one.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn loop_width(
    calibration: &mut Calibration,
    config: &impl Device,
    span_um: (f64, f64),
    hz: f64,
) -> Result<Width, ConfigError> {
    let drive_v = f64::from(calibration.max_drive().0);
    let sine = Sine::new(span_um, hz);
    let (width_um, limits) = traced(calibration, config, &sine)?;
    let cooling = if limits.contains(Limit::Cooling) {
        let share = limit::share(config, drive_v, &sine)?;
        Some(Cooling {
            ideal_um: limit::loop_um(config, drive_v, &sine)?,
            share,
            width_um: traced(calibration, config, &sine.upper(share))?.0,
        })
    } else {
        None
    };
    Ok(Width {
        width_um,
        limits,
        cooling,
    })
}

/// Width of the loop that the core leaves of a sine (um), and what acted.
fn traced(
    calibration: &mut Calibration,
    config: &impl Device,
    sine: &Sine,
) -> Result<(f64, Limits), ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    mirror.hold(sine.low_um, 1.0);
    let mut limits = Limits::NONE;
    let ahead = mirror.track_delay_ticks().into();
    let errors = sine.errors_um(ahead, |asked_um| {
        let (z, acted) = mirror.tick(Setpoint::track(Micrometre(asked_um as f32)));
        limits = limits.union(acted);
        z
    });
    Ok((sine.width_um(&errors), limits))
}

/// Root mean square of the error along a triangle between two positions, over the third to the sixth
/// period (um).
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn triangle(
    calibration: &mut Calibration,
    config: &impl Device,
    (low_um, high_um): (f64, f64),
    hz: f64,
) -> Result<f64, ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    mirror.hold(low_um, 1.0);
    let period = (1.0 / (hz * TICK_S)).round() as usize;
    let ahead = f64::from(mirror.track_delay_ticks());
    let at = |tick: f64| {
        let part = (tick / period as f64).fract();
        low_um + (high_um - low_um) * (1.0 - (2.0 * part - 1.0).abs())
    };
    let errors: Vec<f64> = (1..=6 * period)
        .map(|tick| {
            let asked = mirror.tick(Setpoint::track(Micrometre(at(tick as f64 + ahead) as f32)));
            asked.0 - at(tick as f64)
        })
        .skip(2 * period)
        .collect();
    Ok(rms(&errors))
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len() as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).fold(0.0, f64::max)
}
