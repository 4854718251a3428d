//! Which physics is missing, said only when mirrors that lack nothing would not look the same.

mod explain;
mod form;
mod one_heater;
mod propose;
mod ranking;
mod remainder;
mod step_error;
mod verdict;
mod worth;

use crate::candidate::{Candidate, Operating};
use crate::confusions::Channels;
use crate::held_out::{HeldOut, training_noise};
use crate::null_distribution::{LeftOutFamily, NullDistribution};
use crate::null_ensemble::{MEMBERS, NullEnsemble, coordinates};
use crate::null_improvement::NullImprovement;
use crate::quantile::{quantile, sorted};
use crate::report::{Asked, Diagnosis, Rms, Worths};
use crate::residual_space::{BaseOnly, ResidualSpace, Session, Training, Vector};
use identification::Unit;
use identification::dataset::{self, Dataset, Observation};
use identification::fit::{Fitted, fit, fit_parameters, free_parameters};
use identification::heater;
use identification::prediction::{jacobian, predict, simulations, standard_deviation, white_noise};
use mirror_model::effect::{Active, Effect, built_in, forms};
use mirror_model::{Model, Runaway};
use nalgebra::DVector;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use worth::Now;

/// The base moves so often at most where fits with an effect lead to a better one without it.
const MOVES: usize = 3;

/// Diagnoses a session: which effect, of the built-in ones and `own`, does this model lack?
///
/// Of settled readings no effect is tried that time has a part in, and of a heater on a bench none that changes no current.
///
/// What the model's file states of the mirror narrows the mirrors that it could be. `cache` is a folder for what depends on that
/// and on the session's drives only; the first diagnosis of a kind of session fills it.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn diagnose(
    model: &Model,
    data: &Dataset,
    own: &[Arc<dyn Effect>],
    cache: Option<&Path>,
) -> Result<Diagnosis, Runaway> {
    let (found, _) = diagnose_with_worths(model, data, own, cache, Asked::default())?;
    Ok(found)
}

/// The same, and what it would be worth to know more of the mirror, or to measure more, as far as that is asked: with a null
/// ensemble for each, which takes as long as the first diagnosis of a kind of session.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with_worths(
    model: &Model,
    data: &Dataset,
    own: &[Arc<dyn Effect>],
    cache: Option<&Path>,
    asked: Asked,
) -> Result<(Diagnosis, Worths), Runaway> {
    let begun = simulations();
    let ensemble = NullEnsemble::new(data, &model.device, cache)?;
    let effects = suited(data, own);
    let drawn = simulations();
    let (analysis, candidates) = shown(model, data, &ensemble, &effects)?;
    log::info!("weighing {} effects", candidates.len());
    let found = analysis.conclude(&candidates)?;
    log::info!(
        "simulations of the session: {} for the null ensemble, {} for the diagnosis",
        drawn - begun,
        simulations() - drawn
    );
    let now = Now {
        analysis: &analysis,
        effects: &effects,
        candidates: &candidates,
        named: &found.effects,
        cache,
    };
    let worths = now.worths(asked)?;
    Ok((found, worths))
}

/// The effects that are tried.
fn suited(data: &Dataset, own: &[Arc<dyn Effect>]) -> Vec<Arc<dyn Effect>> {
    let mut effects = [&built_in(), own].concat();
    effects.retain(|effect| !(data.is_steady && effect.is_of_time()));
    effects
}

/// [`explained`], of a heater on a bench without what its currents could not show.
fn shown<'a>(
    model: &Model,
    data: &'a Dataset,
    ensemble: &'a NullEnsemble,
    effects: &[Arc<dyn Effect>],
) -> Result<(Analysis<'a>, Vec<Candidate>), Runaway> {
    let (analysis, mut candidates) = explained(model, data, ensemble, effects)?;
    if data.is_of_heaters() {
        candidates.retain(|candidate| candidate.shows() || candidate.is_infeasible());
    }
    Ok((analysis, candidates))
}

/// A model fitted without an effect, and with it.
pub(crate) struct WithEffect {
    pub(crate) without: Fitted,
    pub(crate) with: Fitted,
    pub(crate) null_improvement: NullImprovement,
}

/// Fits a model without an effect and with it, by the very fits that a diagnosis makes.
///
/// # Errors
/// [`Runaway`] if the model with it has no finite answer.
pub(crate) fn with_effect(
    model: &Model,
    effect: Arc<dyn Effect>,
    data: &Dataset,
    ensemble: &NullEnsemble,
) -> Result<WithEffect, Runaway> {
    let (analysis, mut candidates) = explained(model, data, ensemble, &[effect])?;
    let candidate = candidates.pop().expect("the one that was asked for");
    let null_improvement = analysis.null_improvement(&candidate);
    let with = match candidate.refit {
        Some(refit) => refit.fitted,
        None => {
            let usual = || Active::usual(candidate.effect.clone());
            let active = candidate.explanation.map_or_else(usual, |e| e.active);
            let mut start = analysis.fitted.model.clone();
            start.effects.push(active);
            let all = free_parameters(&start, data);
            fit_parameters(&start, data, &data.values(), &all)?
        }
    };
    Ok(WithEffect {
        without: analysis.fitted,
        with,
        null_improvement,
    })
}

/// The analysis around the fitted base, with these effects tried and explained, the best first. Where fits with one of them lead
/// to a better base, that is the base.
fn explained<'a>(
    model: &Model,
    data: &'a Dataset,
    ensemble: &'a NullEnsemble,
    effects: &[Arc<dyn Effect>],
) -> Result<(Analysis<'a>, Vec<Candidate>), Runaway> {
    log::info!("fitting the base to {} readings", data.observations.len());
    let before = simulations();
    let mut fitted = fit(model, data)?;
    log::info!(
        "the base is fitted, with {} simulations",
        simulations() - before
    );
    let mut moves = 0;
    loop {
        let (analysis, mut candidates) = Analysis::new(data, fitted, ensemble, effects)?;
        analysis.explain(&mut candidates);
        best_first(&mut candidates);
        match analysis.better_base(&candidates).filter(|_| moves < MOVES) {
            Some(better) => fitted = better,
            None => return Ok((analysis, candidates)),
        }
        moves += 1;
    }
}

/// Everything that one session's candidates are judged with.
struct Analysis<'a> {
    data: &'a Dataset,
    ensemble: &'a NullEnsemble,
    null: NullDistribution,
    /// The null ensemble's mirrors, each family in the space of the others.
    left_out: Vec<LeftOutFamily>,
    fitted: Fitted,
    /// Predictions of the fitted base (um, A).
    base: Vec<f64>,
    session: ResidualSpace<Session>,
    training: ResidualSpace<Training>,
    base_only: ResidualSpace<BaseOnly>,
    /// What the base leaves of the session.
    residual: Vector<Session>,
    /// What neither base nor discrepancy explains of it.
    misfit: f64,
    /// What the base leaves on rows held out, once it was asked for.
    held_out: OnceLock<Option<HeldOut>>,
}

impl<'a> Analysis<'a> {
    /// The analysis, and what is tried in it.
    fn new(
        data: &'a Dataset,
        fitted: Fitted,
        ensemble: &'a NullEnsemble,
        effects: &[Arc<dyn Effect>],
    ) -> Result<(Self, Vec<Candidate>), Runaway> {
        let jacobian = jacobian(&fitted.model, data, &fitted.free)?;
        let white = white_noise(data);
        let discrepancy = Arc::new(ensemble.discrepancy(&white));
        let kept = training_noise(data, &white);
        let of_training = Arc::new(ensemble.discrepancy(&kept));
        let session = ResidualSpace::of_all(&jacobian, &discrepancy);
        let base = predict(&fitted.model, data)?;
        let mut candidates = candidates(&fitted, data, &base, effects, &session);
        let left_out = LeftOutFamily::all(&jacobian, &discrepancy, &white);
        let at = coordinates(&fitted.model, data);
        let residual = session.residual(&fitted.standardised(data), &at);
        let analysis = Self {
            data,
            ensemble,
            null: NullDistribution::new(&left_out, is_cramped(data), &mut candidates),
            base,
            left_out,
            training: ResidualSpace::of_all(&jacobian, &of_training),
            base_only: ResidualSpace::of_base(&jacobian),
            misfit: residual.norm_squared(),
            residual,
            session,
            fitted,
            held_out: OnceLock::new(),
        };
        Ok((analysis, candidates))
    }

    fn operating(&self) -> Operating<'_> {
        Operating {
            model: &self.fitted.model,
            data: self.data,
            base: &self.base,
        }
    }

    fn channels(&self) -> Channels {
        Channels::of(self.data)
    }

    /// The unit of the session's errors: the displacement's, or where none was measured the currents'.
    fn unit(&self) -> Unit {
        if self.data.has_displacement() {
            Unit::Micrometre
        } else {
            Unit::Milliampere
        }
    }

    /// Root mean square of a standardised residual over the readings of a unit.
    fn rms(&self, standardised: &DVector<f64>, unit: Unit) -> Rms {
        let rows = standardised.iter().copied();
        rms(rows.zip(&self.data.observations), unit)
    }

    /// What the base leaves of the median mirror of the null ensemble.
    fn discrepancy_rms(&self) -> Rms {
        let unit = self.unit();
        let columns = self.ensemble.residuals().column_iter();
        let sizes = sorted(columns.map(|column| self.rms(&column.into_owned(), unit).value));
        Rms {
            value: quantile(&sizes, 0.5),
            unit,
        }
    }
}

/// Those of these effects that the model has not, with what each would change; in a heater on a bench at the strengths that
/// are plausible there.
fn candidates(
    fitted: &Fitted,
    data: &Dataset,
    base: &[f64],
    effects: &[Arc<dyn Effect>],
    space: &ResidualSpace<Session>,
) -> Vec<Candidate> {
    let heater = heater::heater(&fitted.model, data);
    let unbent = heater.is_some().then(|| heater::unbent(&fitted.model));
    let at = Operating {
        model: unbent.as_ref().unwrap_or(&fitted.model),
        data,
        base,
    };
    let is_present = |effect: &Arc<dyn Effect>| {
        let mut present = fitted.model.effects.iter();
        present.any(|active| active.id() == effect.info().id)
    };
    let suited = |effect: Arc<dyn Effect>| match &heater {
        Some(heater) => heater.suits(&effect),
        None => effect,
    };
    effects
        .iter()
        .filter(|effect| !is_present(effect))
        .map(|effect| {
            let forms = forms(effect).into_iter().map(suited);
            let directions = forms.flat_map(|form| at.directions(&form, space));
            let directions = directions.collect();
            Candidate::new(suited(effect.clone()), directions)
        })
        .collect()
}

/// Whether virtual mirrors tell little of how large scores may be: their residuals span all readings, or they stand for heaters
/// on a bench.
fn is_cramped(data: &Dataset) -> bool {
    data.observations.len() <= MEMBERS || data.is_of_heaters()
}

fn best_first(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.score().total_cmp(&a.score()));
}

/// Root mean square of standardised numbers over the readings of a unit, 0 where there are none.
fn rms<'o>(standardised: impl Iterator<Item = (f64, &'o Observation)>, unit: Unit) -> Rms {
    let numbers = standardised.map(|(value, o)| (value * standard_deviation(o), o));
    let value = match unit {
        Unit::Micrometre => dataset::rms(numbers, true).unwrap_or(0.0),
        Unit::Milliampere => 1e3 * dataset::rms(numbers, false).unwrap_or(0.0),
    };
    Rms { value, unit }
}
