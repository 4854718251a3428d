//! What positioning reaches, measured on a mirror.

use std::f64::consts::TAU;

use control_core::{Calibration, LANES, Limits, Micrometre, Setpoint};
use virtual_mirror::{ConfigError, MirrorConfig};

use crate::{Loop, TICK_S};

/// A loop.
#[derive(Clone, Copy, Debug)]
pub struct Width {
    /// Largest difference between the two ways through one position (um).
    pub width_um: f64,
    /// What acted in the period that was measured. A mirror that cannot cool as fast opens its loop.
    pub limits: Limits,
}

/// Errors at rest (um).
#[derive(Clone, Copy, Debug)]
pub struct Static {
    /// Root mean square.
    pub rms_um: f64,
    /// Largest.
    pub largest_um: f64,
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

/// Static errors from 3 um to the top or 170 um, at positions that no calibration was corrected at.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn at_rest(
    calibration: &mut Calibration,
    config: &MirrorConfig,
) -> Result<Static, ConfigError> {
    const POSITIONS: u32 = 17;
    const STAY_S: f64 = 1.5;
    let top_um = f64::from(calibration.max_position().0).min(170.0);
    let mut mirror = Loop::new(calibration, config)?;
    // A stride that shares no factor with their number: up and down, far and near.
    let errors: Vec<f64> = (0..POSITIONS)
        .map(|i| {
            let place = f64::from(i * 5 % POSITIONS) + 0.37;
            let z_um = top_um * place / f64::from(POSITIONS);
            mirror.hold(z_um, STAY_S) - z_um
        })
        .collect();
    Ok(Static {
        rms_um: rms(&errors),
        largest_um: largest(&errors),
    })
}

/// Steps between pairs of positions, after a second at the first.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn steps(
    calibration: &mut Calibration,
    config: &MirrorConfig,
    pairs: &[(f64, f64)],
) -> Result<Vec<Step>, ConfigError> {
    let drive_v = f64::from(calibration.max_drive().0);
    let mut mirror = Loop::new(calibration, config)?;
    Ok(pairs
        .iter()
        .map(|&(from_um, to_um)| {
            mirror.hold(from_um, 1.0);
            let limit_s = fastest(&mirror, drive_v, from_um, to_um);
            let mut limits = Limits::NONE;
            let setpoint = Setpoint::Position(Micrometre(to_um as f32));
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

/// Time in which the mirror as it is now is within 5 % of the step at the highest drive, or at none.
fn fastest(now: &Loop, drive_v: f64, from_um: f64, to_um: f64) -> f64 {
    let mut mirror = now.mirror().clone();
    let volts = if to_um > from_um { drive_v } else { 0.0 };
    let goal = to_um - 0.05 * (to_um - from_um);
    let mut ticks = 0;
    while (mirror.state().z_um - goal) * (to_um - from_um) < 0.0 && ticks < 100_000 {
        mirror.step([volts; LANES], TICK_S);
        ticks += 1;
    }
    f64::from(ticks) * TICK_S
}

/// The furthest that the mirror moves from where it is a second after a step, in the half minute after
/// that, in parts of the step.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn creep(
    calibration: &mut Calibration,
    config: &MirrorConfig,
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
    config: &MirrorConfig,
    (low_um, high_um): (f64, f64),
    hz: f64,
) -> Result<Width, ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    let (middle, half) = (0.5 * (low_um + high_um), 0.5 * (high_um - low_um));
    mirror.hold(low_um, 1.0);
    let period = (1.0 / (hz * TICK_S)).round() as usize;
    let at = |tick: usize| middle - half * (TAU * tick as f64 / period as f64).cos();
    let course: Vec<(f64, Limits)> = (1..=3 * period)
        .map(|tick| {
            let asked = at(tick);
            let (z, limits) = mirror.tick(Setpoint::Track(Micrometre(asked as f32)));
            (z - asked, limits)
        })
        .skip(2 * period - 1)
        .collect();
    // The k-th tick of a period and the k-th before its end are at one position.
    let apart = (1..period / 2).map(|k| (course[k].0 - course[period - k].0).abs());
    Ok(Width {
        width_um: apart.fold(0.0, f64::max),
        limits: course
            .iter()
            .fold(Limits::NONE, |all, (_, limits)| all.union(*limits)),
    })
}

/// Root mean square of the error along a triangle between two positions, over the third to the sixth
/// period (um).
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn triangle(
    calibration: &mut Calibration,
    config: &MirrorConfig,
    (low_um, high_um): (f64, f64),
    hz: f64,
) -> Result<f64, ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    mirror.hold(low_um, 1.0);
    let period = (1.0 / (hz * TICK_S)).round() as usize;
    let errors: Vec<f64> = (1..=6 * period)
        .map(|tick| {
            let part = (tick % period) as f64 / period as f64;
            let asked = low_um + (high_um - low_um) * (1.0 - (2.0 * part - 1.0).abs());
            mirror.tick(Setpoint::Track(Micrometre(asked as f32))).0 - asked
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
