//! One actuator: from its temperatures to resistance, current, power and heating.

use super::running::{Running, change};
use crate::effect::{Acts, Moment};
use crate::{Deflection, Parameters};

/// Thermal poles of an actuator.
pub(super) const POLES: usize = 3;

pub(super) struct Lane {
    pub(super) parameters: Parameters,
    pub(super) weights: [f64; POLES],
    pub(super) taus_s: [f64; POLES],
    pub(super) poles_k: [f64; POLES],
    pub(super) heating_k: f64,
    pub(super) now: Moment,
    pub(super) current_a: f64,
}

impl Lane {
    pub(super) fn new(parameters: Parameters) -> Self {
        let p = &parameters;
        let moment = Moment {
            resistance_ohm: p.cold_resistance_ohm,
            cold_resistance_ohm: p.cold_resistance_ohm,
            thermal_resistance_k_per_w: p.thermal_resistance_k_per_w,
            curvature_per_k: Deflection::curvature_per_um(p, 1.0),
            ..Moment::default()
        };
        Self {
            weights: [
                1.0 - p.middle_weight - p.slow_weight,
                p.middle_weight,
                p.slow_weight,
            ],
            taus_s: [p.fast_s, p.middle_s, p.slow_s],
            poles_k: [0.0; POLES],
            heating_k: 0.0,
            now: moment,
            current_a: 0.0,
            parameters,
        }
    }

    pub(super) fn raw_temperature(&self) -> f64 {
        self.weights
            .iter()
            .zip(self.poles_k)
            .map(|(weight, pole)| weight * pole)
            .sum()
    }

    /// From the temperatures to resistance, current, power and heating.
    pub(super) fn electrical(&mut self, index: usize, voltage_v: f64, effects: &[Running]) {
        let p = &self.parameters;
        let raw = self.raw_temperature();
        let now = &mut self.now;
        now.voltage_v = voltage_v;
        now.temperature_rise_k = change(effects, Acts::Temperature, index, raw, now);
        now.grown_resistance_ohm =
            p.cold_resistance_ohm * p.resistance_coefficient_per_k * now.temperature_rise_k;
        now.resistance_ohm = p.cold_resistance_ohm + now.grown_resistance_ohm;
        now.resistance_ohm =
            change(effects, Acts::Resistance, index, now.resistance_ohm, now).max(1e-3);
        let heater_v = change(effects, Acts::Voltage, index, voltage_v, now);
        self.current_a = heater_v / now.resistance_ohm;
        now.power_w = heater_v * self.current_a;
        self.heating_k = change(
            effects,
            Acts::Heating,
            index,
            p.thermal_resistance_k_per_w * now.power_w,
            now,
        );
    }
}
