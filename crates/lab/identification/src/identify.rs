//! Identification for a calibration: which stages the data support, one after the other.
//!
//! It is the lab's own fitter on the lab's own effects. The base begins with one thermal pole and no memory. Each
//! candidate, a further pole or an effect that a controller can invert, is fitted together with everything before it, and
//! stays only if the data support it: the misfit falls by more than chance, and its size is known from zero. It must be known in the end
//! too, beside what came later: stepwise regression, forward and backward (Efroymson 1960). What does not stay is told with the reason,
//! and no number is invented for it.

mod backward;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use experiments::Measurement;
use mirror_model::effect::{Active, Effect, find, forms};
use mirror_model::{Model, Runaway, Symbol};
use serde::Serialize;

use crate::base::{identifiable, seeds};
use crate::dataset::Dataset;
use crate::estimate::Estimate;
use crate::fit::{Fitted, fit_parameters};
use crate::fit_report::{known_errors, note_errors};
use crate::parameter::{BaseParameter, FreeParameter};

/// The sum of squares must fall by this share of itself: with hundreds of readings far more than the one part in their
/// count that the F test expects of chance, and enough to be worth inverting.
const WORTHWHILE: f64 = 0.05;
/// A strength is told from zero when it is so many standard errors away from it: 99.7 % of a normal distribution.
const KNOWN: f64 = 3.0;

/// What may be added, in the order of the stages, statics before dynamics. The values to start from need only lie in the valley of
/// the answer: of a pole or a lag one below and one above the decade in which mirrors were found to have it, of creep and hysteresis
/// the same, the strength a usual one.
const CANDIDATES: [Candidate; 11] = [
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

const MIDDLE: Pole = Pole {
    name: "a second thermal pole",
    weight: Symbol::MiddleWeight,
    time: Symbol::MiddleTime,
};
const SLOW: Pole = Pole {
    name: "a slow thermal pole",
    weight: Symbol::SlowWeight,
    time: Symbol::SlowTime,
};

/// A thermal pole of the base.
#[derive(Clone, Copy)]
struct Pole {
    name: &'static str,
    weight: Symbol,
    time: Symbol,
}

impl Pole {
    /// Its weight and its time constant.
    fn parameters(self) -> [FreeParameter; 2] {
        [self.weight, self.time].map(|symbol| FreeParameter::Base(BaseParameter::Shared(symbol)))
    }
}

#[derive(Clone, Copy)]
enum Candidate {
    /// With weights and time constants (s) to start from.
    Pole(Pole, &'static [(f64, f64)]),
    /// By its id, with values to start from; none are its usual ones.
    Effect(&'static str, &'static [&'static [f64]]),
}

/// What was tried, and what became of it.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    /// The pole or the effect.
    pub what: String,
    /// Whether it is in the model.
    pub kept: bool,
    /// Why, in a sentence.
    pub because: String,
    /// What would show it, where these data could not.
    pub shown_by: Option<Measurement>,
}

impl Tried {
    fn was_kept(&self) -> bool {
        self.kept
    }

    fn was_refused(&self) -> bool {
        !self.kept
    }
}

/// What an identification found.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// Every number of the model, with its standard error.
    pub parameters: BTreeMap<String, Estimate>,
    /// What was tried, in order.
    pub tried: Vec<Tried>,
    /// Root mean square of what is left of the displacement, if it was measured.
    pub residual_rms_um: Option<f64>,
    /// Root mean square of what is left of the currents, if they were measured.
    pub residual_rms_ma: Option<f64>,
}

/// Identifies a mirror from a session, starting from `start`, whose own effects stay.
///
/// # Errors
/// [`Runaway`] if the model that it starts from has no finite answer.
pub fn identify(
    start: &Model,
    data: &Dataset,
    files: &[String],
) -> Result<(Model, Identification), Runaway> {
    let mut search = Search::new(start, data)?;
    let mut verdicts = CANDIDATES.map(|candidate| search.consider(candidate));
    // What came later may have taken the place of what came earlier, or uncovered it.
    search.revise(&mut verdicts, Tried::was_kept, Search::reconsider);
    search.revise(&mut verdicts, Tried::was_refused, Search::consider);
    search.revise(&mut verdicts, Tried::was_kept, Search::reconsider);
    let mut fitted = search.best;
    let covariance = note_errors(&mut fitted, data)?;
    let report = Identification {
        parameters: known_errors(&fitted, &covariance),
        tried: verdicts.into_iter().flatten().collect(),
        residual_rms_um: fitted.displacement_rms_um(data),
        residual_rms_ma: fitted.current_rms_ma(data),
    };
    let provenance = &mut fitted.model.provenance;
    provenance.files = files.to_vec();
    provenance.residual_rms_um = report.residual_rms_um;
    provenance.note = Some(format!("identified from {}", fitted.model.preset.name()));
    Ok((fitted.model, report))
}

struct Search<'a> {
    data: &'a Dataset,
    best: Fitted,
    cost: f64,
}

impl<'a> Search<'a> {
    /// The base with one pole.
    fn new(start: &Model, data: &'a Dataset) -> Result<Self, Runaway> {
        let free = identifiable(data);
        let mut model = seeds(start, &free, data).swap_remove(0);
        for pole in [MIDDLE, SLOW] {
            model.parameters.set(pole.weight, 0.0);
            model.by_actuator.remove(&pole.weight);
        }
        let mut parameters: Vec<FreeParameter> = free
            .into_iter()
            .filter(|free| {
                let of = |pole: &Pole| [pole.weight, pole.time].contains(&free.symbol());
                ![MIDDLE, SLOW].iter().any(of)
            })
            .map(FreeParameter::Base)
            .collect();
        for (index, active) in model.effects.iter().enumerate() {
            parameters
                .extend((0..active.values.len()).map(|value| FreeParameter::Effect(index, value)));
        }
        let best = fit_parameters(&model, data, &data.values(), &parameters)?;
        let cost = best.cost(data);
        Ok(Self { data, best, cost })
    }

    /// Takes the candidate in if the data support it. `None` if it has no place to show in these data, or is there
    /// already.
    fn consider(&mut self, candidate: Candidate) -> Option<Tried> {
        let tried = |kept, because: String| {
            Some(Tried {
                what: candidate.name(),
                kept,
                because,
                shown_by: None,
            })
        };
        if !candidate.can_show(self.data) {
            let (lack, shown_by) = candidate.needs();
            let tried = tried(false, lack.into())?;
            return Some(Tried { shown_by, ..tried });
        }
        let (starts, added) = candidate.starts(&self.best.model)?;
        if self.best.free.contains(&added[0]) {
            return None;
        }
        let Some(best) = self.fit_with(candidate, &starts, &added) else {
            return tried(false, "no fit with it has a finite answer".into());
        };
        let fitted_cost = best.cost(self.data);
        if fitted_cost > (1.0 - WORTHWHILE) * self.cost {
            return tried(false, "the misfit does not fall with it".into());
        }
        if let Some(because) = self.doubt(&best, candidate, &added) {
            return tried(false, because);
        }
        let fall = 100.0 * (1.0 - (fitted_cost / self.cost).sqrt());
        (self.best, self.cost) = (best, fitted_cost);
        tried(true, format!("the rms misfit falls by {fall:.0} % with it"))
    }

    /// Looks again at those candidates of which this was found.
    fn revise(
        &mut self,
        verdicts: &mut [Option<Tried>],
        which: fn(&Tried) -> bool,
        look: fn(&mut Self, Candidate) -> Option<Tried>,
    ) {
        for (candidate, verdict) in CANDIDATES.into_iter().zip(verdicts) {
            if verdict.as_ref().is_some_and(which)
                && let Some(again) = look(self, candidate)
            {
                *verdict = Some(again);
            }
        }
    }

    /// Why a fit does not tell a candidate that it has, if it does not.
    fn doubt(
        &self,
        best: &Fitted,
        candidate: Candidate,
        added: &[FreeParameter],
    ) -> Option<String> {
        let pressed = |parameter: &&FreeParameter| parameter.is_at_its_limit(&best.model);
        if let Some(parameter) = candidate.unbounded(added).iter().find(pressed) {
            let name = parameter.name(&best.model);
            return Some(format!("{name} runs to the end of its range"));
        }
        let Some((value, error)) = strength_of(best, added[0], self.data) else {
            return Some("no fit with it has a finite answer".into());
        };
        (value.abs() < KNOWN * error)
            .then(|| format!("its size, {value:.2e} +- {error:.1e}, cannot be told from zero"))
    }

    /// The best fit with the candidate: alone from every start, and then the best together with everything else.
    fn fit_with(
        &self,
        candidate: Candidate,
        starts: &[Model],
        added: &[FreeParameter],
    ) -> Option<Fitted> {
        let values = self.data.values();
        let least = |a: &Fitted, b: &Fitted| a.cost(self.data).total_cmp(&b.cost(self.data));
        let mut alone = added.to_vec();
        if let Candidate::Pole(..) = candidate {
            alone.push(FreeParameter::Base(BaseParameter::Shared(Symbol::FastTime)));
        }
        let fits = starts
            .iter()
            .filter_map(|start| fit_parameters(start, self.data, &values, &alone).ok());
        let best = fits.min_by(least)?;
        let parameters = [&self.best.free[..], added].concat();
        fit_parameters(&best.model, self.data, &values, &parameters).ok()
    }
}

impl Candidate {
    fn name(self) -> String {
        match self {
            Self::Pole(pole, _) => pole.name.into(),
            Self::Effect(id, _) => id.into(),
        }
    }

    /// Models with it to start from, and its parameters. `None` where it is an effect that the model has.
    fn starts(self, model: &Model) -> Option<(Vec<Model>, Vec<FreeParameter>)> {
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
    fn unbounded(self, added: &[FreeParameter]) -> &[FreeParameter] {
        match self {
            Self::Effect("crosstalk", _) => &added[..1],
            Self::Effect("resonance", _) => &added[1..],
            _ => added,
        }
    }

    /// Whether the data could show it at all.
    fn can_show(self, data: &Dataset) -> bool {
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
    fn needs(self) -> (&'static str, Option<Measurement>) {
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

/// A parameter's value, and its standard error.
fn strength_of(fitted: &Fitted, parameter: FreeParameter, data: &Dataset) -> Option<(f64, f64)> {
    let mut noted = fitted.clone();
    let covariance = note_errors(&mut noted, data).ok()?;
    let index = noted.free.iter().position(|other| *other == parameter)?;
    let error = covariance[(index, index)].max(0.0).sqrt() * parameter.scale(&noted.model);
    Some((parameter.value(&noted.model), error))
}

impl Identification {
    /// Says it. `command` says how a measurement is asked for.
    ///
    /// # Errors
    /// Where `f` takes no more.
    pub fn describe(
        &self,
        f: &mut impl fmt::Write,
        command: impl Fn(&Measurement) -> String,
    ) -> fmt::Result {
        for (name, estimate) in &self.parameters {
            let error = estimate.standard_error.unwrap_or(f64::NAN);
            writeln!(
                f,
                "  {name:<26} {:>13.6e} +- {error:.1e} {}",
                estimate.value, estimate.unit
            )?;
        }
        for tried in &self.tried {
            let verdict = if tried.kept { "found" } else { "not found" };
            write!(f, "  {:<26} {verdict}: {}", tried.what, tried.because)?;
            match &tried.shown_by {
                Some(measurement) => writeln!(f, "; `{}` would show it", command(measurement))?,
                None => writeln!(f)?,
            }
        }
        if let Some(rms) = self.residual_rms_um {
            writeln!(f, "  left of the displacement: {rms:.3} um rms")?;
        }
        if let Some(rms) = self.residual_rms_ma {
            writeln!(f, "  left of the currents: {rms:.4} mA rms")?;
        }
        Ok(())
    }
}
