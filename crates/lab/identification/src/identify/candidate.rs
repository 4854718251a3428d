//! What an identification may add to the base: further poles and effects, where each starts, and which data show it.

use std::sync::Arc;

use experiments::Measurement;
use mirror_model::effect::{Active, Effect, find, forms};
use mirror_model::{Model, Symbol};

use crate::dataset::Dataset;
use crate::parameter::{BaseParameter, FreeParameter};

/// What may be added, in the order of the stages, statics before dynamics. The values to start from need only lie in the valley of
/// the answer: of a pole or a lag one below and one above the decade in which mirrors were found to have it, of creep and hysteresis
/// the same, the strength a usual one.
pub(super) const CANDIDATES: [Candidate; 11] = [
    Candidate::Effect("heat-loss-temperature", &[]),
    Candidate::Effect("expansion-temperature", &[]),
    Candidate::Effect("quadratic-tcr", &[]),
    Candidate::Effect("crosstalk", &[]),
    Candidate::Pole(MIDDLE, &[(0.35, 0.035), (0.2, 0.004)]),
    Candidate::Pole(SLOW, &[(0.06, 4.0), (0.1, 0.5)]),
    Candidate::Effect("substrate-warming", &[]),
    Candidate::Effect("resonance", &RESONANCES),
    Candidate::Effect("creep", &[&[0.01, 5.0], &[0.01, 30.0]]),
    Candidate::Effect("hysteresis", &[&[0.02, 3.0], &[0.02, 10.0], &[0.02, 30.0]]),
    Candidate::Effect("thermal-lag", &[&[0.1, 0.003], &[0.1, 0.03]]),
];

/// Amplitude, frequency (Hz) and quality to start from: the misfit has a valley at every few periods. They are a factor of 1.4 apart,
/// from the lowest that is plausible for such mirrors to half of what readings at 10 kHz show.
const RESONANCES: [&[f64]; 9] = [
    &[1.0, 350.0, 15.0],
    &[1.0, 500.0, 15.0],
    &[1.0, 700.0, 15.0],
    &[1.0, 1000.0, 15.0],
    &[1.0, 1400.0, 15.0],
    &[1.0, 2000.0, 15.0],
    &[1.0, 2800.0, 15.0],
    &[1.0, 4000.0, 15.0],
    &[1.0, 5600.0, 15.0],
];
/// Where the fast pole starts beside a second one: films of some micrometres settle within a millisecond (s).
const FAST_S: f64 = 8e-4;

pub(super) const MIDDLE: Pole = Pole {
    name: "a second thermal pole",
    weight: Symbol::MiddleWeight,
    time: Symbol::MiddleTime,
};
pub(super) const SLOW: Pole = Pole {
    name: "a slow thermal pole",
    weight: Symbol::SlowWeight,
    time: Symbol::SlowTime,
};

/// A thermal pole of the base.
#[derive(Clone, Copy)]
pub(super) struct Pole {
    name: &'static str,
    pub(super) weight: Symbol,
    pub(super) time: Symbol,
}

impl Pole {
    /// Its weight and its time constant.
    pub(super) fn parameters(self) -> [FreeParameter; 2] {
        [self.weight, self.time].map(|symbol| FreeParameter::Base(BaseParameter::Shared(symbol)))
    }
}

#[derive(Clone, Copy)]
pub(super) enum Candidate {
    /// With weights and time constants (s) to start from.
    Pole(Pole, &'static [(f64, f64)]),
    /// By its id, with values to start from; none are its usual ones.
    Effect(&'static str, &'static [&'static [f64]]),
}

impl Candidate {
    pub(super) fn name(self) -> String {
        match self {
            Self::Pole(pole, _) => pole.name.into(),
            Self::Effect(id, _) => id.into(),
        }
    }

    /// Models with it to start from, and its parameters. `None` where it is an effect that the model has.
    pub(super) fn starts(self, model: &Model) -> Option<(Vec<Model>, Vec<FreeParameter>)> {
        match self {
            Self::Pole(pole, sizes) => {
                let start = |&(weight, time_s): &(f64, f64)| {
                    let mut with = model.clone();
                    with.parameters.set(pole.weight, weight);
                    with.parameters.set(pole.time, time_s);
                    if pole.time == Symbol::MiddleTime {
                        with.parameters.set(Symbol::FastTime, FAST_S);
                    }
                    with
                };
                Some((
                    sizes.iter().map(start).collect(),
                    pole.parameters().to_vec(),
                ))
            }
            Self::Effect(id, values) => {
                if model.effects.iter().any(|active| active.id() == id) {
                    return None;
                }
                let index = model.effects.len();
                let first = find(id)?;
                let usual = |form: Arc<dyn Effect>| {
                    let mut with = model.clone();
                    with.effects.push(Active::usual(form));
                    with
                };
                let start = |values: &&[f64]| {
                    let mut with = usual(first.clone());
                    with.effects[index].values = values.to_vec();
                    with
                };
                let count = first.info().parameters.len();
                let mut starts: Vec<Model> = values.iter().map(start).collect();
                if starts.is_empty() {
                    starts.extend(forms(&first).into_iter().map(usual));
                }
                let parameters = (0..count).map(|value| FreeParameter::Effect(index, value));
                Some((starts, parameters.collect()))
            }
        }
    }

    /// Those of its parameters whose range is a matter of taste. The share of the opposite actuator's heat is one at most, as where
    /// all actuators heat a common frame; how much rings is told as more or less than all of it where the poles round the heat's beginning,
    /// and its frequency is told all the same.
    pub(super) fn unbounded(self, added: &[FreeParameter]) -> &[FreeParameter] {
        match self {
            Self::Effect("crosstalk", _) => &added[..1],
            Self::Effect("resonance", _) => &added[1..],
            _ => added,
        }
    }

    /// Whether the data could show it at all.
    pub(super) fn can_show(self, data: &Dataset) -> bool {
        let shortest = |limit_s: f64| {
            let resolved = data
                .intervals
                .iter()
                .filter(|piece| piece.duration_s < limit_s);
            resolved.count() > 20
        };
        let longest = |limit_s: f64| {
            let total: f64 = data.intervals.iter().map(|piece| piece.duration_s).sum();
            total > limit_s
        };
        match self {
            Self::Pole(pole, _) if pole.time == Symbol::MiddleTime => shortest(0.02),
            Self::Effect("resonance", _) => data.has_displacement() && shortest(1e-3),
            Self::Effect("thermal-lag", _) => shortest(0.02),
            Self::Pole(..) | Self::Effect("substrate-warming", _) => longest(5.0),
            Self::Effect("creep" | "hysteresis", _) => data.has_displacement() && longest(5.0),
            Self::Effect("quadratic-tcr", _) => data.has_current(),
            Self::Effect("crosstalk", _) => are_driven_apart(data),
            Self::Effect(..) => true,
        }
    }

    /// What these data lack to show it, and what would.
    pub(super) fn needs(self) -> (&'static str, Option<Measurement>) {
        let step = |hold_s| Measurement::Step {
            to_v: 2.0,
            hold_s,
            rate_hz: 5e3,
        };
        match self {
            Self::Pole(pole, _) if pole.time == Symbol::MiddleTime => {
                ("these data are too slow for it", Some(step(30.0)))
            }
            Self::Effect("resonance" | "thermal-lag", _) => {
                ("these data are too slow for it", Some(step(30.0)))
            }
            Self::Effect("quadratic-tcr", _) => ("there are no currents to show it", None),
            Self::Effect("crosstalk", _) => {
                let single = Measurement::Single {
                    max_v: 3.5,
                    steps: 7,
                    dwell_s: 1.0,
                };
                ("all actuators are driven alike", Some(single))
            }
            _ => ("these data are too short for it", Some(step(60.0))),
        }
    }
}

/// Whether some actuators were ever driven while others hardly were.
fn are_driven_apart(data: &Dataset) -> bool {
    data.observations.iter().any(|observation| {
        let volts = data.drive(observation);
        let most = volts.into_iter().fold(0.0, f64::max);
        volts.into_iter().any(|v| v < 0.5 * most)
    })
}
