//! Effects: units of physics that eqs. 1-9 leave out, each in a file of its own.
//!
//! An effect changes one quantity of the chain ([`Acts`]) at every moment, from what the chain shows at that moment
//! ([`Moment`]), its parameters, and states of its own if it has memory. Built-in effects and a user's formulas
//! ([`Formula`]) are the same to everything else. Adding a built-in one means adding its file and its line in `BUILT_IN`.
//!
//! The first parameter of every effect is its strength, and strength 0 is no effect. What nature has in several forms
//! ([`Effect::other_forms`]) is one effect: a diagnosis tries them all, and a model has one of them.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

mod ambient_drift;
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
mod initial_curl;
mod numerals;
mod quadratic_tcr;
mod radiation;
mod resonance;
mod sensor_gain;
mod sensor_lag;
mod sensor_nonlinearity;
mod sensor_offset;
mod series_resistance;
mod size;
mod softening;
mod substrate_warming;
mod thermal_lag;

pub use formula::{Formula, FormulaError};
pub use heater::{Heater, Strengths};

/// The built-in effects, in the order of the chain.
static BUILT_IN: [&dyn Effect; 22] = [
    &series_resistance::SeriesResistance,
    &film_tcr::FilmTcr,
    &quadratic_tcr::QuadraticTcr,
    &heat_loss_temperature::HEAT_LOSS_TEMPERATURE,
    &radiation::Radiation,
    &gap_heat_loss::GapHeatLoss,
    &crosstalk::Crosstalk,
    &substrate_warming::SubstrateWarming,
    &ambient_drift::AmbientDrift,
    &thermal_lag::ThermalLag,
    &expansion_temperature::ExpansionTemperature,
    &softening::Softening,
    &initial_curl::InitialCurl,
    &electrostatic_pull::ElectrostaticPull,
    &end_stop::EndStop,
    &hysteresis::Hysteresis,
    &creep::Creep,
    &resonance::Resonance,
    &sensor_offset::SensorOffset,
    &sensor_gain::SensorGain,
    &sensor_nonlinearity::SensorNonlinearity,
    &sensor_lag::SensorLag,
];

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

    /// Whether time or history enter: readings that are settled, in whatever order they were made, show nothing of it.
    fn is_of_time(&self) -> bool {
        self.states() > 0
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

/// The stage of the chain that an effect belongs to, in the project's vocabulary.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Between the driver and the heater.
    Drive,
    /// The heater's resistance.
    Resistance,
    /// From power to temperature.
    Heat,
    /// From temperature to curvature.
    Curvature,
    /// From curvature to displacement.
    Shape,
    /// What the displacement remembers.
    Memory,
    /// Moving mass.
    Motion,
    /// What reads the displacement.
    Sensor,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drive => "drive",
            Self::Resistance => "resistance",
            Self::Heat => "heat",
            Self::Curvature => "curvature",
            Self::Shape => "shape",
            Self::Memory => "memory",
            Self::Motion => "motion",
            Self::Sensor => "sensor",
        })
    }
}

/// The quantity that an effect changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Acts {
    /// The voltage at one heater (V).
    Voltage,
    /// The resistance of one heater (ohm).
    Resistance,
    /// The temperature rise that one heater's power would make in the end, R_T P (K).
    Heating,
    /// The temperature rise of one actuator (K).
    Temperature,
    /// The curvature of one actuator (1/um).
    Curvature,
    /// The displacement of one actuator (um).
    Displacement,
    /// The displacement of the mirror's centre (um).
    Motion,
    /// The displacement as the sensor reads it (um).
    Reading,
}

impl Acts {
    /// Whether it is a quantity of the whole mirror rather than of each actuator.
    pub fn on_the_mirror(self) -> bool {
        matches!(self, Self::Motion | Self::Reading)
    }
}

/// What the chain shows at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Time from the session's start (s).
    pub t_s: f64,
    /// Voltage at the driver (V).
    pub voltage_v: f64,
    /// Resistance of the heater (ohm).
    pub resistance_ohm: f64,
    /// R0 (1 + xi dT) split: the cold resistance (ohm).
    pub cold_resistance_ohm: f64,
    /// The part of the resistance that grew with temperature (ohm).
    pub grown_resistance_ohm: f64,
    /// Power of this actuator (W).
    pub power_w: f64,
    /// Power of all four (W).
    pub total_power_w: f64,
    /// Power of the actuator across the mirror; they are numbered around it (W).
    pub opposite_power_w: f64,
    /// R_T of this actuator (K/W).
    pub thermal_resistance_k_per_w: f64,
    /// Temperature rise, with that of the surroundings (K).
    pub temperature_rise_k: f64,
    /// Temperature rise of the surroundings since the session's start, where that is known (K).
    pub ambient_k: f64,
    /// Curvature that one kelvin makes (1/(um K)).
    pub curvature_per_k: f64,
    /// Displacement of this actuator, or of the centre for an effect on the whole mirror (um).
    pub z_um: f64,
}

/// One step of the simulation, as an effect with memory sees it.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The effect's input at the step's start.
    pub from: f64,
    /// The effect's input at its end. In between it runs straight.
    pub to: f64,
    /// The step's length (s).
    pub duration_s: f64,
    /// The chain at its end.
    pub moment: Moment,
}

impl Step {
    /// Where a first-order lag of time constant `tau_s` that was at `x` is after the step; exact for a straight input.
    pub fn relax(&self, x: f64, tau_s: f64) -> f64 {
        relax(x, tau_s, self.from, self.to, self.duration_s)
    }
}

/// A first-order lag driven by an input that runs straight from `from` to `to`.
fn relax(x: f64, tau_s: f64, from: f64, to: f64, duration_s: f64) -> f64 {
    if tau_s < 1e-9 {
        return to;
    }
    let behind = (to - from) / duration_s * tau_s;
    to - behind + (x - from + behind) * (-duration_s / tau_s).exp()
}

/// What is known of an effect, for people and for the fit.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Info {
    /// Its name in commands and files.
    pub id: Cow<'static, str>,
    /// What it is, in a few words.
    pub title: Cow<'static, str>,
    /// Where in the chain it belongs.
    pub stage: Stage,
    /// What it changes.
    pub acts: Acts,
    /// Its equation; `'` marks the changed quantity.
    pub equation: Cow<'static, str>,
    /// Its parameters, the strength first.
    pub parameters: Cow<'static, [Parameter]>,
    /// How it shows in measurements.
    pub shows: Cow<'static, str>,
    /// What separates it from its look-alikes.
    pub separates: Cow<'static, str>,
    /// Where its size and form come from.
    pub source: Cow<'static, str>,
}

/// A parameter of an effect.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Parameter {
    /// Its symbol.
    pub symbol: Cow<'static, str>,
    /// Its unit.
    pub unit: Cow<'static, str>,
    /// A usual size.
    pub start: f64,
    /// The lowest plausible value.
    pub low: f64,
    /// The highest plausible value.
    pub high: f64,
}

const fn parameter(
    symbol: &'static str,
    unit: &'static str,
    start: f64,
    low: f64,
    high: f64,
) -> Parameter {
    Parameter {
        symbol: Cow::Borrowed(symbol),
        unit: Cow::Borrowed(unit),
        start,
        low,
        high,
    }
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

/// Lets the built-in effects, which live for ever, stand where any effect does.
struct BuiltIn(&'static dyn Effect);

impl Effect for BuiltIn {
    fn info(&self) -> &Info {
        self.0.info()
    }
    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        self.0.output(parameters, input, state, moment)
    }
    fn form(&self) -> &str {
        self.0.form()
    }
    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        self.0.other_forms()
    }
    fn states(&self) -> usize {
        self.0.states()
    }
    fn is_of_time(&self) -> bool {
        self.0.is_of_time()
    }
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        self.0.strengths_in(heater)
    }
    fn advance(&self, parameters: &[f64], state: &mut [f64], step: &Step) {
        self.0.advance(parameters, state, step);
    }
}

/// The built-in effects, in the order of the chain.
pub fn built_in() -> Vec<Arc<dyn Effect>> {
    BUILT_IN
        .iter()
        .map(|&effect| Arc::new(BuiltIn(effect)) as Arc<dyn Effect>)
        .collect()
}

/// The built-in effect of this id, in the first of its forms.
pub fn find(id: &str) -> Option<Arc<dyn Effect>> {
    built_in().into_iter().find(|effect| effect.info().id == id)
}

/// An effect in all of its forms, itself first.
pub fn forms(effect: &Arc<dyn Effect>) -> Vec<Arc<dyn Effect>> {
    let others = effect.other_forms().iter();
    let others = others.map(|&form| Arc::new(BuiltIn(form)) as Arc<dyn Effect>);
    std::iter::once(effect.clone()).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDS: [&str; 22] = [
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
        "expansion-temperature",
        "electrostatic-pull",
        "end-stop",
        "softening",
        "initial-curl",
        "hysteresis",
        "creep",
        "resonance",
        "sensor-offset",
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

    #[test]
    fn a_lag_is_exact_however_long_the_step() {
        let (mut fine, coarse) = (0.3, relax(0.3, 0.2, 1.0, 3.0, 1.0));
        for i in 0..1000 {
            let at = |i: i32| 1.0 + 2.0 * f64::from(i) / 1000.0;
            fine = relax(fine, 0.2, at(i), at(i + 1), 1e-3);
        }
        assert!((fine - coarse).abs() < 1e-9);
    }
}
