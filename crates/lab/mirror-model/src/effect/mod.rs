//! Effects: units of physics that eqs. 1-9 leave out, each in a file of its own.
//!
//! An effect changes one quantity of the chain ([`Acts`]) at every moment, from what the chain shows at that moment
//! ([`Moment`]), its parameters, and states of its own if it has memory. Built-in effects and a user's formulas
//! ([`Formula`]) are the same to everything else. Adding a built-in one means adding its file and its line in `registry.rs`.
//!
//! The first parameter of every effect is its strength, and strength 0 is no effect. What nature has in several forms
//! ([`Effect::other_forms`]) is one effect: a diagnosis tries them all, and a model has one of them.

use std::fmt;
use std::sync::Arc;

mod ambient_drift;
mod course;
mod creep;
mod crosstalk;
mod electrostatic_pull;
mod end_stop;
mod expansion_temperature;
mod film_tcr;
mod formula;
mod gap_heat_loss;
mod heat_loss_temperature;
mod heater;
mod hysteresis;
mod info;
mod initial_curl;
mod moment;
mod numerals;
mod quadratic_tcr;
mod radiation;
#[cfg(test)]
mod ranges;
mod registry;
mod resonance;
mod sensor_drift;
mod sensor_gain;
mod sensor_lag;
mod sensor_nonlinearity;
mod sensor_offset;
mod series_resistance;
mod size;
mod softening;
mod softplus;
mod squeeze_film;
mod substrate_warming;
mod suited;
mod supply_sag;
mod thermal_lag;

pub use course::constant;
pub use formula::{Formula, FormulaError};
pub use heater::{Heater, Strengths};
pub use info::{Acts, Info, Parameter, Stage, Timing};
pub use moment::{Moment, Step};
pub use registry::{built_in, find, forms};

use info::parameter;

/// A unit of physics. See the module.
pub trait Effect: Send + Sync {
    /// What it is.
    fn info(&self) -> &Info;

    /// The quantity that it acts on, changed. `input` is that quantity without it.
    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64;

    /// Which form of the effect this is, where nature has several; empty where there is one.
    fn form(&self) -> &str {
        ""
    }

    /// The same effect in other forms: with the same id, and equations and parameters of their own.
    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &[]
    }

    /// How many states it keeps, for each actuator or, where it acts on the whole mirror, once. They start at 0.
    fn states(&self) -> usize {
        0
    }

    /// Whether it depends on where the mirror is, beside the quantity that it acts on.
    fn looks_at_displacement(&self) -> bool {
        false
    }

    /// Whether what one actuator does depends on the powers or currents of the others.
    fn looks_at_other_actuators(&self) -> bool {
        false
    }

    /// Whether time or history enter: readings that are settled, in whatever order they were made, show nothing of it.
    fn is_of_time(&self) -> bool {
        self.states() > 0
    }

    /// What its second parameter is in a session's time, where it is that.
    fn timing(&self) -> Option<Timing> {
        None
    }

    /// Whether it adds what is a function of the clock alone to the quantity that it acts on.
    fn is_course(&self) -> bool {
        false
    }

    /// Whether the control core inverts it: by its tables what time has no part in, and by a stage in time what one is made for.
    fn is_inverted(&self) -> bool {
        !self.is_of_time()
    }

    /// The text that it was read from, if it is a user's formula.
    fn definition(&self) -> Option<&str> {
        None
    }

    /// The strengths that are plausible in a heater that is no mirror's, where they depend on it. `None`: those of
    /// [`Info::parameters`].
    fn strengths_in(&self, _heater: &Heater) -> Option<Strengths> {
        None
    }

    /// Moves the states on by one step.
    fn advance(&self, _parameters: &[f64], _state: &mut [f64], _step: &Step) {}
}

/// An effect in a model, with its values.
#[derive(Clone)]
pub struct Active {
    /// Which one.
    pub effect: Arc<dyn Effect>,
    /// The values of its parameters, in its own order.
    pub values: Vec<f64>,
    /// One standard deviation of each, where it is known.
    pub standard_errors: Vec<Option<f64>>,
}

impl Active {
    /// The effect with its usual values.
    pub fn usual(effect: Arc<dyn Effect>) -> Self {
        let values: Vec<_> = effect
            .info()
            .parameters
            .iter()
            .map(|parameter| parameter.start)
            .collect();
        Self {
            effect,
            standard_errors: vec![None; values.len()],
            values,
        }
    }

    /// Its name.
    pub fn id(&self) -> &str {
        &self.effect.info().id
    }
}

impl PartialEq for Active {
    fn eq(&self, other: &Self) -> bool {
        self.id() == other.id()
            && self.effect.form() == other.effect.form()
            && self.values == other.values
            && self.standard_errors == other.standard_errors
    }
}

impl fmt::Debug for Active {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {:?}", self.id(), self.effect.form(), self.values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDS: [&str; 25] = [
        "heat-loss-temperature",
        "radiation",
        "gap-heat-loss",
        "substrate-warming",
        "crosstalk",
        "ambient-drift",
        "thermal-lag",
        "quadratic-tcr",
        "film-tcr",
        "series-resistance",
        "supply-sag",
        "expansion-temperature",
        "electrostatic-pull",
        "end-stop",
        "softening",
        "initial-curl",
        "hysteresis",
        "creep",
        "resonance",
        "squeeze-film",
        "sensor-offset",
        "sensor-drift",
        "sensor-gain",
        "sensor-nonlinearity",
        "sensor-lag",
    ];

    #[test]
    fn the_ids_that_scripts_use_are_all_there() {
        for id in IDS {
            assert!(find(id).is_some(), "{id}");
        }
        assert_eq!(built_in().len(), IDS.len());
    }

    #[test]
    fn every_effect_is_described_and_its_usual_values_are_plausible() {
        for effect in built_in().iter().flat_map(forms) {
            let info = effect.info();
            for text in [
                &info.title,
                &info.equation,
                &info.shows,
                &info.separates,
                &info.source,
            ] {
                assert!(!text.is_empty(), "{}", info.id);
            }
            for p in info.parameters.iter() {
                assert!(
                    p.low <= p.start && p.start <= p.high && p.start != 0.0,
                    "{} {}",
                    info.id,
                    p.symbol
                );
            }
        }
    }
}
