//! Every candidate's best explanation: all are scanned, those worth it are refined, and the best are fitted together with the
//! base.

use super::analysis::{Analysis, best_first};
use crate::candidate::{Candidate, refine, refit, scan};
use crate::progress::Count;
use identification::base::{identifiable, restarts};
use identification::fit::{Fitted, fit_parameters};
use mirror_model::Model;
use rayon::prelude::*;

/// Candidates that are refined: those whose scanned score is this share of the best. This and the following were set by what
/// they cost and by the figures of `cargo xtask bench diagnose`.
const WORTH_REFINING: f64 = 0.25;
/// Candidates that are fitted together with the base: those whose refined score is this share of the best, and half of what
/// they need, so many at most.
const WORTH_REFITTING: f64 = 0.4;
const OF_ITS_THRESHOLD: f64 = 0.5;
const REFITTED: usize = 5;
/// Where none explains the misfit, so many are fitted from other time constants too.
const RESTARTED: usize = 3;
/// A base is fitted anew from where so many of the best candidates lead, and is better where the sum of squares falls by this
/// part of itself.
const LEADS: usize = 2;
const GAIN: f64 = 1e-3;

impl Analysis<'_> {
    /// Gives every candidate that changes a reading its explanation.
    pub(super) fn explain(&self, candidates: &mut [Candidate]) {
        let tried = Count::of("effects tried", candidates.len());
        candidates.par_iter_mut().for_each(|candidate| {
            candidate.explanation = tried.after(scan(&candidate.directions, &self.residual));
        });
        // Four heaters with all of a mirror's experiments are too many readings for that.
        if self.data.is_one_heater() {
            let shown = candidates.par_iter_mut().filter(|c| c.shows());
            shown.for_each(|candidate| {
                let fitted = self.fitted_together(candidate);
                (candidate.explanation, candidate.refit) = fitted.unzip();
            });
            return;
        }
        self.refine(candidates);
        self.refit(candidates);
        let above = candidates
            .par_iter_mut()
            .filter(|c| c.is_above_its_threshold());
        above.for_each(|candidate| self.prefer_inverted(candidate));
    }

    fn refine(&self, candidates: &mut [Candidate]) {
        let scores = candidates.iter().map(Candidate::score);
        let worth = WORTH_REFINING * scores.fold(0.0, f64::max);
        candidates.par_iter_mut().for_each(|candidate| {
            let start = candidate.explanation.as_mut();
            if let Some(start) = start.filter(|start| start.score > worth.max(0.0)) {
                *start = refine(start, self.operating(), &self.residual, &self.session);
            }
        });
    }

    /// Fits the best candidates together with the base. Where none of them explains the misfit, all the others too, and the
    /// best of all from other time constants: where the base is fitted without an effect may lie far from where the effect is
    /// seen.
    fn refit(&self, candidates: &mut [Candidate]) {
        best_first(candidates);
        let Some(best) = candidates.first().map(Candidate::score) else {
            return;
        };
        let is_worth = |candidate: &Candidate| {
            let score = candidate.score();
            score > WORTH_REFITTING * best && score > OF_ITS_THRESHOLD * candidate.threshold
        };
        candidates.sort_by_key(|candidate| !is_worth(candidate));
        let worth = candidates.partition_point(is_worth).min(REFITTED);
        let fitted = std::slice::from_ref(&self.fitted.model);
        self.refit_from(fitted, &mut candidates[..worth]);
        if !self.is_explained(candidates) {
            self.refit_from(fitted, &mut candidates[worth..]);
        }
        if !self.is_explained(candidates) {
            best_first(candidates);
            let restarted = RESTARTED.min(candidates.len());
            let starts = restarts(&self.fitted.model, &identifiable(self.data), self.data);
            self.refit_from(&starts, &mut candidates[..restarted]);
        }
    }

    /// A better fit of the base than the one that candidates were tried around, found where the fit with one of them leads: what
    /// it gains is the base's, and no effect's.
    pub(super) fn better_base(&self, candidates: &[Candidate]) -> Option<Fitted> {
        let cost = self.fitted.cost(self.data);
        let leads = candidates.iter().filter(|c| c.score() > c.threshold);
        leads
            .filter_map(|candidate| candidate.refit.as_ref())
            .take(LEADS)
            .filter_map(|refit| {
                let mut start = refit.fitted.model.clone();
                start.effects.pop();
                fit_parameters(&start, self.data, &self.data.values(), &self.fitted.free).ok()
            })
            .find(|better| better.cost(self.data) < (1.0 - GAIN) * cost)
    }

    fn is_explained(&self, candidates: &[Candidate]) -> bool {
        let mut scores = candidates.iter().map(Candidate::score);
        scores.any(|score| self.null.explains(self.misfit, score.max(0.0)))
    }

    /// Replaces explanations by better ones, fitted together with the base from these starts.
    fn refit_from(&self, starts: &[Model], candidates: &mut [Candidate]) {
        let fitted = Count::of("effects fitted together with the base", candidates.len());
        candidates.par_iter_mut().for_each(|candidate| {
            fitted.after(());
            let Some(so_far) = &candidate.explanation else {
                return;
            };
            let active = &so_far.active;
            let refits = starts
                .par_iter()
                .filter_map(|model| refit(active, model, self.data, &self.session, self.misfit));
            let best = refits.max_by(|(a, _), (b, _)| a.score.total_cmp(&b.score));
            // A fit in the ordinary sense may end elsewhere than the best in the session's space.
            if let Some((best, refit)) = best.filter(|(best, _)| best.score > so_far.score) {
                candidate.explanation = Some(best.explanation(so_far.change.clone()));
                candidate.refit = Some(refit);
            }
        });
    }
}
