//! Identification for a calibration: which stages the data support, one after the other.
//!
//! It is the lab's own fitter on the lab's own effects. The base begins with one thermal pole and no memory. Each
//! candidate, a further pole or an effect that a controller can invert, is fitted together with everything before it, and
//! stays only if the data support it: the misfit falls by more than chance, and its size is known from zero. It must be known in the end
//! too, beside what came later: stepwise regression, forward and backward (Efroymson 1960). What does not stay is told with the reason,
//! and no number is invented for it.

mod backward;
mod candidate;

use std::collections::BTreeMap;
use std::fmt;

use experiments::Measurement;
use mirror_model::{Model, Runaway, Symbol};
use serde::Serialize;

use crate::base::{identifiable, seeds};
use crate::dataset::Dataset;
use crate::estimate::Estimate;
use crate::fit::{Fitted, fit_parameters};
use crate::fit_report::{covariance, known_errors, note_errors, unbounded_error};
use crate::parameter::{BaseParameter, FreeParameter};
use crate::prediction::jacobian;
use candidate::{CANDIDATES, Candidate, MIDDLE, Pole, SLOW};

/// The sum of squares must fall by this share of itself: with hundreds of readings far more than the one part in their
/// count that the F test expects of chance, and enough to be worth inverting.
const WORTHWHILE: f64 = 0.05;
/// A strength is told from zero when it is so many standard errors away from it: 99.7 % of a normal distribution.
const KNOWN: f64 = 3.0;

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
    for kept in [true, false, true] {
        search.revise(&mut verdicts, kept);
    }
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

    /// Looks again at the candidates that were kept, or at those that were refused.
    fn revise(&mut self, verdicts: &mut [Option<Tried>], kept: bool) {
        for (candidate, verdict) in CANDIDATES.into_iter().zip(verdicts) {
            if verdict.as_ref().is_none_or(|tried| tried.kept != kept) {
                continue;
            }
            let again = match kept {
                true => self.reconsider(candidate),
                false => self.consider(candidate),
            };
            if again.is_some() {
                *verdict = again;
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

/// A parameter's value, and its standard error as if no bound held anything.
fn strength_of(fitted: &Fitted, parameter: FreeParameter, data: &Dataset) -> Option<(f64, f64)> {
    let slopes = jacobian(&fitted.model, data, &fitted.free).ok()?;
    let covariance = covariance(&slopes, fitted, data);
    let index = fitted.free.iter().position(|other| *other == parameter)?;
    let error = unbounded_error(fitted, &covariance, index);
    Some((parameter.value(&fitted.model), error))
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
            writeln!(f, "{}", estimate.line(name, 26))?;
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
