//! One actuator: from its temperatures to resistance, current, power and heating.

use super::lag::Lag;
use super::running::{Running, change};
use crate::effect::{Acts, Moment};
use crate::{ACTUATORS, Deflection, Parameters};

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

/// The lags of every lane's poles over a step; most lanes have the same.
pub(super) fn lags(lanes: &[Lane; ACTUATORS], h: f64) -> [[Lag; POLES]; ACTUATORS] {
    let first = lanes[0].taus_s.map(|tau| Lag::new(tau, h));
    std::array::from_fn(|index| {
        if lanes[index].taus_s == lanes[0].taus_s {
            first
        } else {
            lanes[index].taus_s.map(|tau| Lag::new(tau, h))
        }
    })
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

    /// How much the heating at the end of a step changes with the heating that was assumed there: a hotter heater has more
    /// resistance and takes less power.
    pub(super) fn attraction(&self, lags: &[Lag; POLES]) -> f64 {
        let arrives: f64 = self
            .weights
            .iter()
            .zip(lags)
            .map(|(weight, lag)| weight * lag.takes_end)
            .sum();
        let p = &self.parameters;
        -arrives * self.heating_k * p.cold_resistance_ohm * p.resistance_coefficient_per_k
            / self.now.resistance_ohm
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
        now.temperature_rise_k =
            now.ambient_k + change(effects, Acts::Temperature, index, raw, now);
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
