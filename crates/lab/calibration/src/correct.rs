//! Tables bent by what was measured at rest.

use control_core::calibration::Parts;
use control_core::shape::{KNOTS, SEGMENTS};
use control_core::{ActuatorCalibration, Calibration, CalibrationError, InverseTable, Micrometre};

use crate::curve::Curve;

/// A position that was asked of the core under a calibration, and where the mirror came to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticPoint {
    /// What was asked for.
    pub asked_um: f64,
    /// What was measured.
    pub reached_um: f64,
}

/// Why points do not correct a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorrectionError {
    /// Too few.
    #[error("{0} measured points are too few to correct a table; measure at least 4")]
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
    const FEWEST: usize = 4;
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
        let asked_um = asked_at.at(z_um).min(old_top);
        *knot = rise_at.at(asked_um) as f32;
    }
    InverseTable::new(Micrometre(top_um as f32), knots).map_err(CalibrationError::from)
}
