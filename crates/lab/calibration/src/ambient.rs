//! What a kelvin of the surroundings is worth to a mirror, from where it came to rest in another room.

use control_core::calibration::{ActuatorCalibration, Parts, Residual, SENSED_RISES};
use control_core::{Calibration, CalibrationError, Micrometre};

use crate::residual::MEASURED_RATIO;

/// A position that was asked of the core in other surroundings, and where the mirror came to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomPoint {
    /// What was asked for.
    pub asked_um: f64,
    /// What was measured.
    pub reached_um: f64,
    /// How much warmer the core took the surroundings for (K).
    pub rise_k: f64,
}

/// Why points do not tell what a room is worth.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AmbientError {
    /// The calibration does not know what resistances tell.
    #[error("the calibration does not know the heaters' resistances; calibrate the mirror first")]
    Unknown,
    /// They were taken in one room.
    #[error(
        "the two rooms are only {0:.1} K apart; measure where they are at least {LEAST_K} K apart"
    )]
    SameRoom(f64),
    /// No mirror is like that.
    #[error("what the room is worth cannot be used: {0}")]
    Calibration(#[from] CalibrationError),
}

/// Rooms nearer to that of the calibration tell it to a percent at best: 0.05 um of 1.8 um/K.
const LEAST_K: f64 = 3.0;

/// `calibration` with the ratio that takes the mirror to where it was asked to be, by least squares.
///
/// The core asks an actuator for `(1 - ratio) rise` more than at calibration, as its resistance tells it, so what it then
/// misses in proportion to the rise is the ratio's.
///
/// # Errors
/// Where the calibration does not know the resistances, or the points are of one room.
pub fn with_ambient_ratio(
    calibration: &Calibration,
    points: &[RoomPoint],
) -> Result<Calibration, AmbientError> {
    let parts = calibration.parts();
    if parts.ambient_ratio == 0.0 {
        return Err(AmbientError::Unknown);
    }
    let farthest_k = points.iter().map(|p| p.rise_k.abs()).fold(0.0, f64::max);
    if farthest_k < LEAST_K {
        return Err(AmbientError::SameRoom(farthest_k));
    }
    let (mut missed, mut moved) = (0.0, 0.0);
    for point in points {
        let slopes = parts
            .actuators
            .iter()
            .map(|it| um_per_k(it, point.asked_um));
        let by_um = point.rise_k * slopes.sum::<f64>() / parts.actuators.len() as f64;
        missed += by_um * (point.reached_um - point.asked_um);
        moved += by_um * by_um;
    }
    Ok(Calibration::new(Parts {
        ambient_ratio: parts.ambient_ratio + (missed / moved) as f32,
        residual: Residual {
            ambient_ratio: MEASURED_RATIO,
            ..parts.residual
        },
        ..*parts
    })?)
}

/// How far an actuator moves at a position with each kelvin that its resistance tells (um/K).
fn um_per_k(actuator: &ActuatorCalibration, um: f64) -> f64 {
    let top_um = f64::from(actuator.shape.top().0);
    let around = [um - 0.02 * top_um, um + 0.02 * top_um].map(|um| um.clamp(0.0, top_um));
    let sensed = around.map(|um| {
        let rise = actuator.shape.temperature_rise(Micrometre(um as f32));
        sensed_k(actuator, f64::from(rise.0))
    });
    (around[1] - around[0]) / (sensed[1] - sensed[0])
}

/// What the resistance tells at a rise of the stages (K).
fn sensed_k(actuator: &ActuatorCalibration, rise: f64) -> f64 {
    let sensed = &actuator.sensed_rises;
    let place = rise / f64::from(sensed.top.0) * (SENSED_RISES - 1) as f64;
    let segment = (place as usize).min(SENSED_RISES - 2);
    let knot = |i: usize| f64::from(sensed.knots[i]);
    knot(segment) + (place - segment as f64) * (knot(segment + 1) - knot(segment))
}
