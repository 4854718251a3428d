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
        "the two rooms are only {0:.1} K apart; measure where they are at least {LEAST_APART_K} K apart"
    )]
    SameRoom(f64),
    /// No mirror is like that.
    #[error("what the room is worth cannot be used: {0}")]
    Calibration(#[from] CalibrationError),
}

/// So far apart two rooms must be to tell the ratio (K). Nearer ones tell it to a percent at best: 0.05 um of 1.8 um/K.
pub const LEAST_APART_K: f64 = 3.0;

/// Of what resistances tell of a room: by so much a curve may be off at one position (`control_core`'s estimate of the surroundings).
const CURVE: f64 = 0.02;

/// `calibration` with the ratio that takes the mirror to where it was asked to be, by least squares.
///
/// The core asks an actuator for `(1 - ratio) rise` more than at calibration, as its resistance tells it, so what it then
/// misses in proportion to the rise is the ratio's. How well it is known follows from what the calibration leaves at rest, in both rooms,
/// and from the curves, at each point for itself.
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
    if farthest_k < LEAST_APART_K {
        return Err(AmbientError::SameRoom(farthest_k));
    }
    let at_rest_um = 2.0_f64.sqrt() * f64::from(parts.residual.piston.0);
    let (mut missed, mut moved, mut unsure) = (0.0, 0.0, 0.0);
    for point in points {
        let by_um = point.rise_k * mean_um_per_k(parts, point.asked_um);
        missed += by_um * (point.reached_um - point.asked_um);
        moved += by_um * by_um;
        unsure += (by_um * at_rest_um.hypot(CURVE * by_um)).powi(2);
    }
    let deviation = f64::from(MEASURED_RATIO).hypot(unsure.sqrt() / moved);
    Ok(Calibration::new(Parts {
        ambient_ratio: parts.ambient_ratio + (missed / moved) as f32,
        residual: Residual {
            ambient_ratio: deviation as f32,
            ..parts.residual
        },
        ..*parts
    })?)
}

/// How much further a mirror stands (um) under `found` than under `calibration`, which has another ratio and nothing else, where the same is
/// asked for in surroundings so much warmer (K).
pub fn further_um(
    (calibration, found): (&Calibration, &Calibration),
    asked_um: f64,
    rise_k: f64,
) -> f64 {
    let parts = calibration.parts();
    let more = f64::from(found.parts().ambient_ratio) - f64::from(parts.ambient_ratio);
    -more * rise_k * mean_um_per_k(parts, asked_um)
}

/// `calibration` for a board that leaves the mirror to the surroundings.
pub fn without_surroundings(calibration: &Calibration) -> Calibration {
    Calibration::new(Parts {
        ambient_ratio: 0.0,
        ..*calibration.parts()
    })
    .expect("surroundings may be unknown")
}

/// How far the mirror moves at a position with each kelvin that its resistances tell (um/K).
fn mean_um_per_k(parts: &Parts, um: f64) -> f64 {
    let slopes = parts.actuators.iter().map(|it| um_per_k(it, um));
    slopes.sum::<f64>() / parts.actuators.len() as f64
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

#[cfg(test)]
mod tests {
    use control_core::calibration::SensedRises;
    use control_core::shape::SEGMENTS;
    use control_core::{InverseTable, Kelvin};
    use mirror_model::{Model, Preset};

    use super::*;

    const TOP_UM: f32 = 160.0;
    const RATIO: f32 = 1.02;

    /// A calibration that moves by 2 um with each kelvin, which the resistances tell as they are.
    fn two_um_per_k() -> Calibration {
        let tabulated = crate::tabulate(&Model::from(Preset::Reconciled)).expect("it tabulates");
        let top_k = 0.5 * TOP_UM;
        let line = |i: usize, of: usize| top_k * i as f32 / of as f32;
        let mut parts = *tabulated.calibration.parts();
        parts.ambient_ratio = RATIO;
        for actuator in &mut parts.actuators {
            let knots = std::array::from_fn(|i| line(i, SEGMENTS));
            actuator.shape = InverseTable::new(Micrometre(TOP_UM), knots).expect("it rises");
            actuator.sensed_rises = SensedRises {
                top: Kelvin(top_k),
                knots: std::array::from_fn(|i| line(i, SENSED_RISES - 1)),
            };
        }
        Calibration::new(parts).expect("a mirror can have it")
    }

    fn point(asked_um: f64, off_um: f64, rise_k: f64) -> RoomPoint {
        RoomPoint {
            asked_um,
            reached_um: asked_um + off_um,
            rise_k,
        }
    }

    #[test]
    fn what_is_missed_in_proportion_to_the_room_is_the_ratios() {
        // A tenth of 2 um/K: in a room 10 K warmer 2 um, in one 5 K colder 1 um the other way.
        let points = [
            point(60.0, 2.0, 10.0),
            point(120.0, 2.0, 10.0),
            point(90.0, -1.0, -5.0),
        ];
        let found = with_ambient_ratio(&two_um_per_k(), &points).expect("two rooms");
        // What f32 keeps of 1, a hundred times over for the secants of the tables.
        assert!((found.parts().ambient_ratio - 1.12).abs() < 1e-5);
        // And with it none of them is missed.
        for at in points {
            let further_um = further_um((&two_um_per_k(), &found), at.asked_um, at.rise_k);
            let off_um = at.reached_um + further_um - at.asked_um;
            assert!(off_um.abs() < 1e-4, "{off_um}");
        }
    }

    /// Of three points 10 K apart the curves leave 0.02 / sqrt(3), and 0.3 um at rest, twice, 0.42 of 20 um by that root.
    #[test]
    fn a_ratio_is_known_as_well_as_positions_and_curves_are() {
        let points = [60.0, 90.0, 120.0].map(|um| point(um, 0.5, 10.0));
        let deviation = |piston_um| {
            let mut parts = *two_um_per_k().parts();
            parts.residual.piston.0 = piston_um;
            let calibration = Calibration::new(parts).expect("a mirror can have it");
            let found = with_ambient_ratio(&calibration, &points).expect("two rooms");
            f64::from(found.parts().residual.ambient_ratio)
        };
        // f32, and the secants of the tables.
        let is = |told: f64, expected: f64| (told - expected).abs() < 1e-5;
        assert!(is(deviation(0.0), 0.01_f64.hypot(0.011_547)));
        assert!(is(
            deviation(0.3),
            0.01_f64.hypot(0.011_547).hypot(0.012_247)
        ));
    }

    #[test]
    fn a_mirror_that_stays_where_it_was_keeps_its_ratio() {
        let points = [point(60.0, 0.0, 10.0), point(120.0, 0.0, -8.0)];
        let found = with_ambient_ratio(&two_um_per_k(), &points).expect("two rooms");
        assert_eq!(found.parts().ambient_ratio, RATIO);
    }

    #[test]
    fn rooms_that_are_alike_tell_nothing() {
        let points = [point(60.0, 0.5, 2.9), point(120.0, 0.5, -1.0)];
        let found = with_ambient_ratio(&two_um_per_k(), &points);
        assert_eq!(found, Err(AmbientError::SameRoom(2.9)));
    }

    #[test]
    fn resistances_that_nobody_measured_tell_nothing() {
        let mut parts = *two_um_per_k().parts();
        parts.ambient_ratio = 0.0;
        let unknown = Calibration::new(parts).expect("a mirror can have it");
        let found = with_ambient_ratio(&unknown, &[point(60.0, 2.0, 10.0)]);
        assert_eq!(found, Err(AmbientError::Unknown));
    }
}
