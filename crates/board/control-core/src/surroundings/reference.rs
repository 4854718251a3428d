//! What one actuator's resistance tells where nothing has changed since calibration: the curve T = s(dT).

use crate::calibration::{ActuatorCalibration, SENSED_RISES, SensedRises};
use crate::units::Kelvin;

/// What turns one actuator's reading into the filter's measurement, and the estimate into its target.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// What its resistance tells at calibration, at equal steps of the stages' rise (K).
    sensed: [f32; SENSED_RISES],
    steps_per_kelvin: f32,
    /// Slope of that at rest, s'(0), and its inverse.
    first_slope: f32,
    pub(super) per_first_slope: f32,
    loss_growth: f32,
    /// Temperature that doubles the resistance, for the noise.
    pub(super) cold_kelvin: f32,
}

impl Reference {
    pub(super) fn new(actuator: &ActuatorCalibration) -> Self {
        let SensedRises { top, knots } = &actuator.sensed_rises;
        let steps_per_kelvin = (SENSED_RISES - 1) as f32 / top.0;
        let first_slope = (knots[1] - knots[0]) * steps_per_kelvin;
        Self {
            sensed: *knots,
            steps_per_kelvin,
            first_slope,
            per_first_slope: 1.0 / first_slope,
            loss_growth: actuator.loss_growth.0,
            cold_kelvin: 1.0 / actuator.tcr.0,
        }
    }

    /// What the resistance tells at a rise of the stages where the surroundings are those of the calibration, s, and how
    /// fast that grows, s'. The ends go on straight.
    pub(super) fn sensed(&self, rise: Kelvin) -> (f32, f32) {
        let place = rise.0 * self.steps_per_kelvin;
        // What is below zero, or no number, becomes 0.
        let segment = (place as usize).min(SENSED_RISES - 2);
        let (low, high) = (self.sensed[segment], self.sensed[segment + 1]);
        let step = high - low;
        (
            low + (place - segment as f32) * step,
            step * self.steps_per_kelvin,
        )
    }

    /// (1 + 2 g dT) s'(0) / s', where the curve is so steep.
    pub(super) fn sensitivity(&self, rise: Kelvin, slope: f32) -> f32 {
        (1.0 + 2.0 * self.loss_growth * rise.0) * self.first_slope / slope
    }

    /// g / s'(0).
    pub(super) fn room_growth(&self) -> f32 {
        self.loss_growth * self.per_first_slope
    }

    /// Kelvins of the surroundings for each of the stages' rise: (1 + 2 g dT) s'(0), and 1 where no resistance tells.
    pub(super) fn loss_slope(&self, rise: Kelvin) -> f32 {
        let slope = (1.0 + 2.0 * self.loss_growth * rise.0) * self.first_slope;
        if slope > 0.0 { slope } else { 1.0 }
    }

    /// q s'(0).
    pub(super) fn heating(&self, rise: Kelvin) -> f32 {
        rise.0 * (1.0 + self.loss_growth * rise.0) * self.first_slope
    }
}
