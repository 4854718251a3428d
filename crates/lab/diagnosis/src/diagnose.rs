//! Which physics is missing, said only when mirrors with nothing missing would not look the same.

mod heaters;
mod ranking;
mod verdict;

use crate::base::{identifiable, restarts};
use crate::candidate::{Direction, Explanation, directions, refine, refit, scan};
use crate::ensemble::Ensemble;
use crate::fit::{Fitted, fit, jacobian, predict, trust, white_noise};
use crate::heater;
use crate::judge::{Calm, judges, quantile};
use crate::plan::{self, Observation, Plan};
use crate::report::Diagnosis;
use crate::space::{Approximation, Space, Vector};
use mirror_model::effect::{Active, Effect, built_in};
use mirror_model::{Model, Runaway};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

use ranking::held_out_rows;

/// Rows held out go by handfuls of readings; as noise they get this factor, so that they weigh nothing.
const HANDFUL: usize = 5;
const HIDDEN: f64 = 1e6;
/// Candidates that are fitted together with the base: those whose refined score is this share of the best, so many at most.
const WORTH_REFITTING: f64 = 0.4;
const REFITTED: usize = 5;
/// Where none explains the misfit, so many are fitted from other time constants too.
const RESTARTED: usize = 3;
/// A change of the readings whose square is below this is none.
const UNSEEN: f64 = 1e-6;
/// Candidates that are refined: those whose scanned score is this share of the best.
const WORTH_REFINING: f64 = 0.25;

/// Diagnoses a session: which effect, of the built-in ones and `own`, does this model lack?
///
/// `cache` is a folder for what depends on the session's drives only; the first diagnosis of a kind of session fills it.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn diagnose(
    model: &Model,
    plan: &Plan,
    own: &[Arc<dyn Effect>],
    cache: Option<&Path>,
) -> Result<Diagnosis, Runaway> {
    let fitted = fit(model, plan)?;
    let bench = Bench::new(plan, fitted, own, cache)?;
    let trial = bench.trial();
    bench.conclude(trial)
}

/// Everything that one session is judged with.
struct Bench<'a> {
    plan: &'a Plan,
    fitted: Fitted,
    base: Vec<f64>,
    space: Space,
    /// The space in which the rows held out weigh nothing.
    kept: Space,
    /// The space in which the base is free, and the approximation is a misfit like any other.
    plain: Space,
    residual: Vector,
    /// Residuals of the virtual mirrors, in units of trust.
    mirrors: DMatrix<f64>,
    effects: Vec<(Arc<dyn Effect>, Vec<Direction>)>,
    calm: Calm,
    approximation_rms: f64,
}

/// What came out of fitting every candidate.
struct Trial {
    /// By effect, in the order of `Bench::effects`.
    explanations: Vec<Option<Explanation>>,
    misfit: f64,
}

impl<'a> Bench<'a> {
    fn new(
        plan: &'a Plan,
        fitted: Fitted,
        own: &[Arc<dyn Effect>],
        cache: Option<&Path>,
    ) -> Result<Self, Runaway> {
        let slopes = jacobian(&fitted.model, plan, &fitted.knobs)?;
        let ensemble = Ensemble::new(plan, cache)?;
        let white = white_noise(plan);
        let kept_noise = white.zip_map(&held_out_rows(plan), |sigma, held_out| {
            if held_out { HIDDEN * sigma } else { sigma }
        });
        let approximation = Arc::new(Approximation::new(&ensemble.0, &white));
        let kept = Arc::new(Approximation::new(&ensemble.0, &kept_noise));
        let all = || (0..approximation.mirrors()).collect();
        let space = Space::new(&slopes, &approximation, all());
        let kept = Space::new(&slopes, &kept, all());
        let plain = Space::of_base(&slopes);
        let base = predict(&fitted.model, plan)?;
        let residual = space.vector(&fitted.scaled(plan));
        let heater = heater::heater(&fitted.model, plan);
        let judged = if heater.is_some() {
            &heater::unbent(&fitted.model)
        } else {
            &fitted.model
        };
        let suited = |effect: Arc<dyn Effect>| match &heater {
            Some(heater) => heater.suits(&effect),
            None => effect,
        };
        let present = |effect: &Arc<dyn Effect>| {
            fitted
                .model
                .effects
                .iter()
                .any(|active| active.id() == effect.info().id)
        };
        let effects: Vec<_> = built_in()
            .into_iter()
            .chain(own.iter().cloned())
            .filter(|effect| !present(effect))
            .map(suited)
            .map(|effect| {
                let directions = directions(&effect, judged, plan, &base, &space);
                (effect, directions)
            })
            .filter(|(_, directions)| heater.is_none() || shows(directions, &space))
            .collect();
        let calm = Calm::new(&effects, &judges(&slopes, &approximation, &white));
        let columns = ensemble.0.column_iter();
        let mut sizes: Vec<f64> = columns.map(|c| rms(plan, c.iter().copied())).collect();
        sizes.sort_by(f64::total_cmp);
        let approximation_rms = quantile(&sizes, 0.5);
        Ok(Self {
            plan,
            fitted,
            base,
            space,
            kept,
            plain,
            residual,
            mirrors: ensemble.0,
            effects,
            calm,
            approximation_rms,
        })
    }

    fn trial(&self) -> Trial {
        let scanned: Vec<_> = self
            .effects
            .iter()
            .map(|(_, directions)| scan(directions, &self.residual, &self.space))
            .collect();
        let misfit = self.space.product(&self.residual, &self.residual);
        // Four heaters with all of a mirror's experiments are too many readings for that.
        if self.plan.is_one_heater() {
            let explanations = scanned.into_par_iter();
            let explanations = explanations.map(|scanned| self.fitted_together(&scanned?, misfit));
            return Trial {
                explanations: explanations.collect(),
                misfit,
            };
        }
        let best = scanned
            .iter()
            .flatten()
            .map(|e| e.score)
            .fold(0.0, f64::max);
        let explanations = scanned
            .into_par_iter()
            .map(|explanation| {
                explanation.map(|e| {
                    if e.score > WORTH_REFINING * best && e.score > 0.0 {
                        refine(
                            &e,
                            &self.fitted.model,
                            self.plan,
                            &self.base,
                            &self.residual,
                            &self.space,
                        )
                    } else {
                        e
                    }
                })
            })
            .collect();
        Trial {
            explanations: self.refitted(explanations, misfit),
            misfit,
        }
    }

    /// The best explanations with base and effect fitted together. Where none of them explains the misfit, all the others
    /// too, and the best of all from other time constants: where the base is fitted without an effect may lie far from where
    /// the effect is seen.
    fn refitted(
        &self,
        mut explanations: Vec<Option<Explanation>>,
        misfit: f64,
    ) -> Vec<Option<Explanation>> {
        let fitted = std::slice::from_ref(&self.fitted.model);
        let order = best_first(&explanations);
        let Some(&first) = order.first() else {
            return explanations;
        };
        let best = score(&explanations, first);
        let (mut worth, mut others): (Vec<_>, Vec<_>) = order.into_iter().partition(|&index| {
            let score = score(&explanations, index);
            score > WORTH_REFITTING * best && score > 0.5 * self.calm.thresholds[index]
        });
        others.extend(worth.drain(REFITTED.min(worth.len())..));
        self.refit_from(fitted, &mut explanations, &worth, misfit);
        let is_explained = |explanations: &[Option<Explanation>]| {
            let mut scores = (0..explanations.len()).map(|index| score(explanations, index));
            scores.any(|score| self.calm.explains(misfit, score.max(0.0)))
        };
        if !is_explained(&explanations) {
            self.refit_from(fitted, &mut explanations, &others, misfit);
        }
        if !is_explained(&explanations) {
            let mut best = best_first(&explanations);
            best.truncate(RESTARTED);
            let starts = restarts(&self.fitted.model, &identifiable(self.plan));
            self.refit_from(&starts, &mut explanations, &best, misfit);
        }
        explanations
    }

    /// Replaces explanations by better ones, fitted together with the base from these starts.
    fn refit_from(
        &self,
        starts: &[Model],
        explanations: &mut [Option<Explanation>],
        order: &[usize],
        misfit: f64,
    ) {
        let better: Vec<_> = order
            .par_iter()
            .filter_map(|&index| {
                let so_far = explanations[index].as_ref()?;
                let refits = starts
                    .par_iter()
                    .filter_map(|model| refit(so_far, model, self.plan, &self.space, misfit));
                let best = refits.max_by(|a, b| a.score.total_cmp(&b.score))?;
                // A fit in the ordinary sense may end elsewhere than the best in the session's space.
                (best.score > so_far.score).then_some((index, best))
            })
            .collect();
        for (index, e) in better {
            explanations[index] = Some(e);
        }
    }

    fn id(&self, index: usize) -> String {
        self.effects[index].0.info().id.to_string()
    }
}

/// Whether an effect changes any reading. A heater's show neither shape nor motion nor what reads a displacement.
fn shows(directions: &[Direction], space: &Space) -> bool {
    let size = |d: &Direction| space.product(&d.change, &d.change);
    directions.iter().any(|direction| size(direction) > UNSEEN)
}

fn score(explanations: &[Option<Explanation>], index: usize) -> f64 {
    explanations[index].as_ref().map_or(0.0, |e| e.score)
}

/// The effects that have an explanation, by their scores.
fn best_first(explanations: &[Option<Explanation>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..explanations.len())
        .filter(|&index| explanations[index].is_some())
        .collect();
    order.sort_by(|&a, &b| score(explanations, b).total_cmp(&score(explanations, a)));
    order
}

/// Whether an effect's strength lies inside its plausible range, not at an end that holds it back.
fn is_plausible(active: &Active) -> bool {
    let (p, value) = (&active.effect.info().parameters[0], active.values[0]);
    let margin = 1e-3 * (p.high - p.low);
    value < p.high - margin && (value > p.low + margin || p.low == 0.0)
}

/// Root mean square of numbers in units of trust for each observation: over the displacements, in um, or
/// where none was measured over the currents, in mA.
fn rms(plan: &Plan, units_of_trust: impl Iterator<Item = f64>) -> f64 {
    let observed = units_of_trust.zip(&plan.observations);
    rms_of(observed, plan.has_displacement())
}

/// Root mean square over the displacements, in um, or over the currents, in mA.
fn rms_of<'o>(
    units_of_trust: impl Iterator<Item = (f64, &'o Observation)>,
    displacement: bool,
) -> f64 {
    let unit = if displacement { 1.0 } else { 1e3 };
    let numbers = units_of_trust.map(|(value, o)| (value * trust(o), o));
    unit * plan::rms(numbers, displacement).unwrap_or(0.0)
}
