//! Tables bent by what was measured at rest.

use control_core::calibration::Parts;
use control_core::shape::{KNOTS, SEGMENTS};
use control_core::{ActuatorCalibration, Calibration, CalibrationError, InverseTable, Micrometre};

use crate::curve::{Curve, beyond};

/// A position that was asked of the core under a calibration, and where the mirror came to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticPoint {
    /// What was asked for.
    pub asked_um: f64,
    /// What was measured.
    pub reached_um: f64,
}

/// With rest they are five: fewer leave a piecewise cubic no piece of which both ends have slopes from both sides.
const FEWEST: usize = 4;

/// Why points do not correct a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorrectionError {
    /// Too few.
    #[error("{0} measured points are too few to correct a table; measure at least {FEWEST}")]
    TooFew(usize),
    /// More asked was not more reached.
    #[error(
        "the mirror did not go further when asked to: {from_um:.3} um were asked before {to_um:.3} um, and reached after"
    )]
    NotRising {
        /// The lower position that was asked for.
        from_um: f64,
        /// The higher one.
        to_um: f64,
    },
    /// The corrected table is none.
    #[error("the corrected table cannot be used: {0}")]
    Calibration(#[from] CalibrationError),
}

/// `calibration` with its tables bent so that what was reached is what will be asked for.
///
/// The points were measured under `calibration` itself, in any order; rest is added to them. Between
/// them the correction is a smooth curve, so that the calibration's own shape is kept. Its top becomes
/// what the former top reaches.
///
/// # Errors
/// Where there are too few points or they do not rise.
pub fn corrected(
    calibration: &Calibration,
    points: &[StaticPoint],
) -> Result<Calibration, CorrectionError> {
    let mut points: Vec<_> = points.iter().filter(|p| p.asked_um > 0.0).collect();
    if points.len() < FEWEST {
        return Err(CorrectionError::TooFew(points.len()));
    }
    points.sort_by(|a, b| a.asked_um.total_cmp(&b.asked_um));
    let with_rest = |part: fn(&StaticPoint) -> f64| {
        std::iter::once(0.0)
            .chain(points.iter().map(|&p| part(p)))
            .collect::<Vec<_>>()
    };
    let (asked, reached) = (with_rest(|p| p.asked_um), with_rest(|p| p.reached_um));
    let not_rising = |i: usize| CorrectionError::NotRising {
        from_um: asked[i - 1],
        to_um: asked[i],
    };
    let reached_at = Curve::new(asked.clone(), reached.clone()).map_err(not_rising)?;
    let asked_at = Curve::new(reached, asked.clone()).map_err(not_rising)?;
    let parts = calibration.parts();
    let mut actuators = parts.actuators;
    let top_um = reached_at.at(f64::from(calibration.max_position().0));
    for actuator in &mut actuators {
        actuator.shape = bent(actuator, top_um, &asked_at)?;
    }
    Ok(Calibration::new(Parts {
        actuators,
        ..*parts
    })?)
}

/// An actuator's table up to `top_um`, where a position is reached that was asked for as `asked_at` it (um).
pub(crate) fn bent(
    actuator: &ActuatorCalibration,
    top_um: f64,
    asked_at: &Curve,
) -> Result<InverseTable, CalibrationError> {
    let old_top = f64::from(actuator.shape.top().0);
    // The table between its knots as a smooth curve: the knots move against each other.
    let positions = (0..KNOTS).map(|i| old_top * i as f64 / SEGMENTS as f64);
    let rises = actuator.shape.knots().iter().map(|rise| f64::from(*rise));
    let rise_at = Curve::new(positions.collect(), rises.collect())
        .expect("a table rises, that is what it was made with");
    let mut knots = [0.0; KNOTS];
    for (i, knot) in knots.iter_mut().enumerate().skip(1) {
        let z_um = top_um * i as f64 / SEGMENTS as f64;
        *knot = beyond(|um| rise_at.at(asked_at.at(um)), asked_at.end(), z_um) as f32;
    }
    InverseTable::new(Micrometre(top_um as f32), knots).map_err(CalibrationError::from)
}

#[cfg(test)]
mod tests {
    use mirror_model::{Model, Preset};

    use super::*;

    /// Half a kelvin a micrometre, up to here.
    const TOP_UM: f32 = 160.0;
    const K_PER_UM: f32 = 0.5;
    /// What f32 keeps of a hundred micrometres.
    const F32: f32 = 1e-4;

    /// A calibration whose tables are straight lines.
    fn straight() -> Calibration {
        let tabulated = crate::tabulate(&Model::from(Preset::Reconciled)).expect("it tabulates");
        let knots = std::array::from_fn(|i| K_PER_UM * TOP_UM * i as f32 / SEGMENTS as f32);
        let mut parts = *tabulated.calibration.parts();
        for actuator in &mut parts.actuators {
            actuator.shape = InverseTable::new(Micrometre(TOP_UM), knots).expect("it rises");
        }
        Calibration::new(parts).expect("a mirror can have it")
    }

    fn reached(part: f64, asked_um: &[f64]) -> Vec<StaticPoint> {
        let point = |&asked_um: &f64| StaticPoint {
            asked_um,
            reached_um: part * asked_um,
        };
        asked_um.iter().map(point).collect()
    }

    #[test]
    fn a_mirror_that_goes_nine_tenths_of_the_way_is_asked_for_ten_ninths() {
        let points = reached(0.9, &[150.0, 30.0, 60.0, 100.0]);
        let corrected = corrected(&straight(), &points).expect("it corrects");
        let shape = &corrected.actuators()[2].shape;
        assert!((shape.top().0 - 144.0).abs() < F32);
        let rise = shape.temperature_rise(Micrometre(72.0));
        assert!((rise.0 - K_PER_UM * 80.0).abs() < F32, "{rise:?}");
    }

    #[test]
    fn a_mirror_that_is_where_it_was_asked_to_be_keeps_its_tables() {
        let points = reached(1.0, &[40.0, 80.0, 120.0, 155.0]);
        let corrected = corrected(&straight(), &points).expect("it corrects");
        let (new, old) = (corrected.actuators(), straight());
        for (new, old) in new.iter().zip(old.actuators()) {
            let knots = new.shape.knots().iter().zip(old.shape.knots());
            assert!(knots.into_iter().all(|(new, old)| (new - old).abs() < F32));
        }
    }

    #[test]
    fn three_points_are_too_few_and_rest_is_none() {
        let mut points = reached(0.9, &[40.0, 80.0, 120.0]);
        points.push(StaticPoint {
            asked_um: 0.0,
            reached_um: 0.0,
        });
        assert_eq!(
            corrected(&straight(), &points),
            Err(CorrectionError::TooFew(3))
        );
    }

    #[test]
    fn a_mirror_that_goes_back_when_asked_to_go_on_corrects_nothing() {
        let mut points = reached(1.0, &[40.0, 80.0, 120.0, 150.0]);
        points[2].reached_um = 70.0;
        let expected = CorrectionError::NotRising {
            from_um: 80.0,
            to_um: 120.0,
        };
        assert_eq!(corrected(&straight(), &points), Err(expected));
    }
}
