//! Which physics is missing, said only when mirrors that lack nothing would not look the same.

mod analysis;
mod expected_gain;
mod explain;
mod follows;
mod form;
mod form_error;
mod inside;
mod notes;
mod odd_file;
mod one_heater;
mod propose;
mod ranking;
mod remainder;
mod rivals;
mod step_error;
mod suspects;
mod verdict;

use crate::candidate::Candidate;
use crate::null_ensemble::{Misdescribed, NullEnsemble};
use crate::null_improvement::NullImprovement;
use crate::report::{Asked, Diagnosis, ExpectedGains};
use analysis::{Analysis, best_first};
use expected_gain::Now;
use identification::dataset::Dataset;
use identification::fit::{Fitted, fit, fit_parameters, free_parameters};
use identification::prediction::simulations;
use mirror_model::effect::{Active, Effect, built_in};
use mirror_model::{Device, Model, Runaway};
use std::path::Path;
use std::sync::Arc;

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
    let (found, _) = diagnose_with_gains(model, data, own, cache, Asked::default())?;
    Ok(found)
}

/// The same, and what it would be worth to know more of the mirror, or to measure more, as far as that is asked: with a null
/// ensemble for each, which takes as long as the first diagnosis of a kind of session.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with_gains(
    model: &Model,
    data: &Dataset,
    own: &[Arc<dyn Effect>],
    cache: Option<&Path>,
    asked: Asked,
) -> Result<(Diagnosis, ExpectedGains), Runaway> {
    let begun = simulations();
    let Begun {
        fitted,
        ensemble,
        misdescribed,
    } = Begun::new(model, data, cache)?;
    let effects = suited(data, own);
    let drawn = simulations();
    let (analysis, mut candidates) = shown(fitted, data, &ensemble, &effects)?;
    log::info!("weighing {} effects", candidates.len());
    let mut found = analysis.conclude(&mut candidates)?;
    found
        .notes
        .splice(0..0, misdescribed.map(|it| it.to_string()));
    log::info!(
        "simulations of the session: {} for the base and the null ensemble, {} for the diagnosis",
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
    let gains = now.gains(asked)?;
    Ok((found, gains))
}

/// A session's base, and the mirrors that it is held against.
pub(crate) struct Begun {
    fitted: Fitted,
    ensemble: NullEnsemble,
    /// Why they are not those that the model's file describes.
    misdescribed: Option<Misdescribed>,
}

impl Begun {
    /// With all mirrors, where the session's is none of those that are described.
    pub(crate) fn new(
        model: &Model,
        data: &Dataset,
        cache: Option<&Path>,
    ) -> Result<Self, Runaway> {
        log::info!("fitting the base to {} readings", data.observations.len());
        let before = simulations();
        let mut fitted = fit(model, data)?;
        log::info!(
            "the base is fitted, with {} simulations",
            simulations() - before
        );
        let mut ensemble = NullEnsemble::new(data, &model.device, cache)?;
        let is_described = model.device != Device::default();
        let misdescribed = ensemble.misdescribed(&fitted.model, data);
        let misdescribed = misdescribed.filter(|_| is_described);
        if misdescribed.is_some() {
            fitted.model.device = Device::default();
            ensemble = NullEnsemble::new(data, &fitted.model.device, cache)?;
        }
        Ok(Self {
            ensemble: ensemble.moving_as(&fitted.model, data),
            fitted,
            misdescribed,
        })
    }
}

/// The effects that are tried.
fn suited(data: &Dataset, own: &[Arc<dyn Effect>]) -> Vec<Arc<dyn Effect>> {
    let mut effects = [&built_in(), own].concat();
    effects.retain(|effect| !(data.is_steady && effect.is_of_time()));
    effects
}

/// [`explained`], of a heater on a bench without what its currents could not show.
fn shown<'a>(
    fitted: Fitted,
    data: &'a Dataset,
    ensemble: &'a NullEnsemble,
    effects: &[Arc<dyn Effect>],
) -> Result<(Analysis<'a>, Vec<Candidate>), Runaway> {
    let (analysis, mut candidates) = explained(fitted, data, ensemble, effects)?;
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
    cache: Option<&Path>,
) -> Result<WithEffect, Runaway> {
    let Begun {
        fitted, ensemble, ..
    } = Begun::new(model, data, cache)?;
    let (analysis, mut candidates) = explained(fitted, data, &ensemble, &[effect])?;
    let mut candidate = candidates.pop().expect("the one that was asked for");
    analysis.choose_form(&mut candidate);
    analysis.fit_with_base(&mut candidate);
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
    // What the owner has described stays in the file, also where no such mirror was measured.
    let described = |fitted: Fitted| Fitted {
        model: Model {
            device: model.device.clone(),
            ..fitted.model
        },
        ..fitted
    };
    Ok(WithEffect {
        without: described(analysis.fitted),
        with: described(with),
        null_improvement,
    })
}

/// The analysis around the fitted base, with these effects tried and explained, the best first. Where fits with one of them lead
/// to a better base, that is the base.
fn explained<'a>(
    mut fitted: Fitted,
    data: &'a Dataset,
    ensemble: &'a NullEnsemble,
    effects: &[Arc<dyn Effect>],
) -> Result<(Analysis<'a>, Vec<Candidate>), Runaway> {
    let mut moves = 0;
    loop {
        let (analysis, mut candidates) = Analysis::new(data, fitted, ensemble, effects)?;
        analysis.explain(&mut candidates);
        best_first(&mut candidates);
        match analysis.better_base(&candidates).filter(|_| moves < MOVES) {
            Some(better) => fitted = better,
            None => {
                analysis.fit_leading_forms(&mut candidates);
                analysis.take_inside(&mut candidates);
                return Ok((analysis, candidates));
            }
        }
        moves += 1;
    }
}
