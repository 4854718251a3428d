//! Tables read forward, and bent to what was found.

use std::iter;

use control_core::shape::{KNOTS, SEGMENTS};
use control_core::{ActuatorCalibration, CalibrationError, InverseTable, Micrometre};

use super::error::RefineError;
use super::heat::HeatLoss;
use super::linear::LinearStages;
use crate::curve::Curve;

const RISES: &str = "a table rises, that is what it was made with";

/// An actuator's table from temperature rise (K) to displacement (um).
pub(super) fn forward(actuator: &ActuatorCalibration) -> Curve {
    let (positions, rises) = knots(actuator);
    Curve::new(rises, positions).expect(RISES)
}

/// The bend that all tables get.
pub(super) struct Bend {
    /// From a displacement to the place of the tables that gives it (um).
    place_at: Curve,
    /// The displacement at the end of the tables.
    top_um: f64,
}

impl Bend {
    /// # Errors
    /// Where the bent shape does not rise.
    pub(super) fn of(linear: &LinearStages, top_um: f64) -> Result<Self, RefineError> {
        let read_um = |place: f64| linear.rest_um() + linear.shape(place);
        let places = (1..KNOTS).map(|i| position(top_um, i));
        // What is below the sensor's zero cannot be asked for, and what is below the mirror's rest not be reached: nothing heats it at zero.
        let above = places
            .map(|place| (read_um(place), place))
            .filter(|(read_um, _)| *read_um > 0.0);
        let (read, places) = iter::once((0.0, 0.0)).chain(above).unzip();
        Ok(Self {
            place_at: Curve::new(read, places).map_err(|_| RefineError::NoFit)?,
            top_um: read_um(top_um),
        })
    }

    /// An actuator's table, bent, for a heat loss that was `before` and is `after`.
    ///
    /// # Errors
    /// Where a board does not take the table.
    pub(super) fn table(
        &self,
        actuator: &ActuatorCalibration,
        before: &HeatLoss,
        after: &HeatLoss,
    ) -> Result<InverseTable, CalibrationError> {
        let (positions, rises) = knots(actuator);
        let rise_at = Curve::new(positions, rises).expect(RISES);
        let mut knots = [0.0; KNOTS];
        for (i, knot) in knots.iter_mut().enumerate().skip(1) {
            let place = self.place_at.at(position(self.top_um, i));
            *knot = after.rise(before.heating(rise_at.at(place))) as f32;
        }
        InverseTable::new(Micrometre(self.top_um as f32), knots).map_err(CalibrationError::from)
    }
}

fn position(top_um: f64, knot: usize) -> f64 {
    top_um * knot as f64 / SEGMENTS as f64
}

/// Positions (um) and temperature rises (K) of an actuator's table.
fn knots(actuator: &ActuatorCalibration) -> (Vec<f64>, Vec<f64>) {
    let top_um = f64::from(actuator.shape.top().0);
    let rises = actuator.shape.knots().iter().map(|rise| f64::from(*rise));
    let positions = (0..KNOTS).map(|i| position(top_um, i));
    (positions.collect(), rises.collect())
}
