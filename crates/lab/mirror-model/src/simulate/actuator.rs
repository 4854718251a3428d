//! One actuator: from its temperatures to resistance, current, power and heating.

use super::pole::Pole;
use super::running::{Running, change};
use crate::effect::{Acts, Moment};
use crate::{ACTUATORS, Deflection, Parameters};

/// No effect makes a heater a better conductor than this (ohm): it would be a short circuit.
const LEAST_OHM: f64 = 1e-3;
/// Thermal poles of an actuator, a Foster network: each takes its share of the heating, and the rises add up.
pub(super) const POLES: usize = 3;

/// An actuator while it runs.
#[derive(Clone, Copy)]
pub(super) struct Actuator {
    pub(super) parameters: Parameters,
    /// The poles' shares, which add up to 1, and time constants.
    pub(super) weights: [f64; POLES],
    pub(super) taus_s: [f64; POLES],
    /// State of each pole: the rise that all heating would make of it.
    pub(super) poles_k: [f64; POLES],
    /// The rise that the present power would make in the end, R_T P.
    pub(super) heating_k: f64,
    pub(super) now: Moment,
    pub(super) current_a: f64,
}

/// Every actuator's thermal poles over a step; most actuators have the same.
pub(super) fn poles(actuators: &[Actuator; ACTUATORS], h: f64) -> [[Pole; POLES]; ACTUATORS] {
    let first = actuators[0].taus_s.map(|tau| Pole::new(tau, h));
    std::array::from_fn(|index| {
        if actuators[index].taus_s == actuators[0].taus_s {
            first
        } else {
            actuators[index].taus_s.map(|tau| Pole::new(tau, h))
        }
    })
}

impl Actuator {
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

    /// How much the heating at the end of a step changes with the heating that was assumed there, the slope of the function whose
    /// fixed point is sought: a hotter heater has more resistance and takes less power.
    pub(super) fn slope(&self, poles: &[Pole; POLES]) -> f64 {
        let arrives: f64 = self
            .weights
            .iter()
            .zip(poles)
            .map(|(weight, pole)| weight * pole.end_gain)
            .sum();
        let p = &self.parameters;
        -arrives * self.heating_k * p.cold_resistance_ohm * p.resistance_coefficient_per_k
            / self.now.resistance_ohm
    }

    /// The resistance at the end of a step of `h` at which power and temperature agree (ohm), where no effect acts between them. With
    /// R = R0 (1 + xi dT), dT = free + gain H and heating H = R_T V^2 / R it is the root of R^2 - R0 (1 + xi free) R = R0 xi gain R_T V^2
    /// that a rising drive comes to (eqs. 3 and 4). `None` where there is none: a heater that conducts ever better runs away.
    pub(super) fn agreed_ohm(
        &self,
        poles: &[Pole; POLES],
        voltage_v: f64,
        ambient_k: f64,
        h: f64,
    ) -> Option<f64> {
        let p = &self.parameters;
        let (mut free_k, mut gain) = (ambient_k + self.raw_temperature(), 0.0);
        if h > 0.0 {
            free_k = ambient_k;
            for ((weight, pole), x) in self.weights.iter().zip(poles).zip(self.poles_k) {
                free_k += weight * pole.after(x, self.heating_k, 0.0);
                gain += weight * pole.end_gain;
            }
        }
        let xi = p.resistance_coefficient_per_k;
        let without_ohm = p.cold_resistance_ohm * (1.0 + xi * free_k);
        let growth_ohm_per_k = p.cold_resistance_ohm * xi * gain;
        let full = p.thermal_resistance_k_per_w * voltage_v * voltage_v;
        let square = without_ohm * without_ohm + 4.0 * growth_ohm_per_k * full;
        let ohm = 0.5 * (without_ohm + square.sqrt());
        (without_ohm >= LEAST_OHM && ohm >= LEAST_OHM).then_some(ohm)
    }

    /// From a resistance to current, power and heating, where no effect acts on any of them.
    pub(super) fn at_ohm(&mut self, ohm: f64, voltage_v: f64) {
        self.now.voltage_v = voltage_v;
        self.now.resistance_ohm = ohm;
        self.now.grown_resistance_ohm = ohm - self.parameters.cold_resistance_ohm;
        self.current_a = voltage_v / ohm;
        self.now.power_w = voltage_v * self.current_a;
        self.heating_k = self.parameters.thermal_resistance_k_per_w * self.now.power_w;
    }

    /// The temperature rise by the poles alone, before effects (K).
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
            change(effects, Acts::Resistance, index, now.resistance_ohm, now).max(LEAST_OHM);
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
