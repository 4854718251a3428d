//! A grey body in a room.

use super::{Acts, Effect, Heater, Info, Moment, Parameter, Stage, Strengths, parameter};
use std::borrow::Cow;

pub(super) struct Radiation;

// 1 % of the 22.6 mW that the paper's heater takes at 3.5 V (eqs. 3 and 4), over (423 K)^4 - (295 K)^4; ten times that at most.
static PARAMETERS: [Parameter; 1] = [parameter("k", "W/K^4", 1e-14, 0.0, 1e-13)];

static INFO: Info = Info {
    id: Cow::Borrowed("radiation"),
    title: Cow::Borrowed("radiation"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("P' = P - k ((T0 + dT)^4 - T0^4)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("as a heat loss that grows with temperature, but steepest at the top"),
    separates: Cow::Borrowed("vacuum; much hotter drives"),
    source: Cow::Borrowed("Stefan-Boltzmann: about 1 % of the power at 150 degC"),
};

/// T0, a room of 22 degC (K).
const AMBIENT_K: f64 = 295.0;

/// (T0 + dT)^4 - T0^4, in K^4. Nothing is colder than 0 K, not even a solver's guess.
fn emitted(temperature_rise_k: f64) -> f64 {
    (AMBIENT_K + temperature_rise_k).max(0.0).powi(4) - AMBIENT_K.powi(4)
}

impl Effect for Radiation {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let lost = emitted(m.temperature_rise_k) - emitted(m.ambient_k);
        x - p[0] * m.thermal_resistance_k_per_w * lost
    }

    /// At the hottest a filament in vacuum radiates all of its power; half as much again, since how hot that is is known
    /// as well as the resistance is straight. It may be less hot, where nothing was read while it was cold.
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        let all = heater.hottest_power_w / emitted(heater.hottest_rise_k);
        Some(Strengths {
            usual: 0.1 * all,
            low: 0.0,
            high: 1.5 * heater.hottest_power_w / emitted(heater.least_rise_k),
        })
    }
}
