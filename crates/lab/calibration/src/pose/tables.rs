//! An actuator's table, and the curve of its resistance, in f64.

use control_core::calibration::{Parts, SENSED_RISES};
use control_core::shape::SEGMENTS;
use control_core::{ActuatorCalibration, CHANNELS};

/// The temperature rise over the position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    top_um: f64,
    knots_k: Vec<f64>,
}

impl Table {
    pub(super) fn new(top_um: f64, knots_k: Vec<f64>) -> Self {
        Self { top_um, knots_k }
    }

    pub(super) fn rise(&self, um: f64) -> f64 {
        let place = (um / self.top_um * SEGMENTS as f64).max(0.0);
        let segment = (place as usize).min(SEGMENTS - 1);
        let (low, high) = (self.knots_k[segment], self.knots_k[segment + 1]);
        low + (place - segment as f64) * (high - low)
    }

    /// The position at a rise, straight on beyond the ends (um).
    pub(super) fn position_um(&self, rise: f64) -> f64 {
        let above = self.knots_k.partition_point(|knot| *knot <= rise);
        let segment = above.clamp(1, SEGMENTS) - 1;
        let (low, high) = (self.knots_k[segment], self.knots_k[segment + 1]);
        self.top_um / SEGMENTS as f64 * (segment as f64 + (rise - low) / (high - low))
    }
}

pub(super) fn tables(parts: &Parts) -> [Table; CHANNELS] {
    parts.actuators.each_ref().map(|actuator| {
        let knots = actuator.shape.knots().iter();
        Table::new(
            f64::from(actuator.shape.top().0),
            knots.map(|k| f64::from(*k)).collect(),
        )
    })
}

/// What a resistance tells over the rise of its actuator.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SensedCurve {
    step_k: f64,
    knots_k: Vec<f64>,
}

impl SensedCurve {
    /// Those of a calibration that knows them.
    pub(super) fn of_all(parts: &Parts) -> Option<[Self; CHANNELS]> {
        let mut actuators = parts.actuators.iter();
        let are_known = actuators.all(|actuator| actuator.sensed_rises.is_known());
        are_known.then(|| parts.actuators.each_ref().map(Self::of))
    }

    pub(super) fn of(actuator: &ActuatorCalibration) -> Self {
        let sensed = &actuator.sensed_rises;
        Self {
            step_k: f64::from(sensed.top.0) / (SENSED_RISES - 1) as f64,
            knots_k: sensed.knots.iter().map(|k| f64::from(*k)).collect(),
        }
    }

    /// What it tells (K), and how fast that grows.
    pub(super) fn at(&self, rise: f64) -> (f64, f64) {
        let place = rise / self.step_k;
        let segment = (place.max(0.0) as usize).min(SENSED_RISES - 2);
        let (low, high) = (self.knots_k[segment], self.knots_k[segment + 1]);
        let step = high - low;
        (low + (place - segment as f64) * step, step / self.step_k)
    }
}
