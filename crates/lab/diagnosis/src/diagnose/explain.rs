//! Every candidate's best explanation: all are scanned, those worth it are refined, and the best are fitted together with the
//! base.

use super::analysis::{Analysis, best_first};
use crate::candidate::{Candidate, Found, Refit, Scan, Strength, refine, refit};
use crate::confusions::{RIVAL_SHARE, confusions};
use crate::progress::Count;
use identification::base::{identifiable, restarts};
use identification::fit::{Fitted, Precision, fit_parameters};
use mirror_model::Model;
use mirror_model::effect::Active;

/// Candidates that are refined: those whose scanned score is this share of the best. This and the following were set by what
/// they cost and by the figures of `cargo xtask bench diagnose`.
const WORTH_REFINING: f64 = 0.25;
/// Candidates that are fitted together with the base: those whose refined score is this share of the best, and half of what
/// they need, so many at most. So near to the best a candidate is fitted in all of its forms, too.
pub(super) const WORTH_REFITTING: f64 = 0.4;
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
        parallel::map(candidates.iter_mut(), |candidate| {
            candidate.explanation =
                tried.after(Scan::new(&candidate.directions).explanation(&self.residual));
        });
        // Four heaters with all of a mirror's experiments are too many readings for that.
        if self.data.is_one_heater() {
            let shown = candidates.iter_mut().filter(|c| c.shows());
            parallel::map(shown, |candidate| {
                let fitted = self.fitted_together(candidate);
                (candidate.explanation, candidate.refit) = fitted.unzip();
            });
            return;
        }
        self.refine(candidates);
        self.refit(candidates);
        self.fit_near_ones_from_elsewhere(candidates);
        self.fit_the_best_from_elsewhere(candidates);
    }

    fn refine(&self, candidates: &mut [Candidate]) {
        let scores = candidates.iter().map(Candidate::score);
        let worth = WORTH_REFINING * scores.fold(0.0, f64::max);
        parallel::map(candidates.iter_mut(), |candidate| {
            let start = candidate.explanation.as_mut();
            if let Some(start) = start.filter(|start| start.score > worth.max(0.0)) {
                *start = refine(start, self.operating(), &self.residual, &self.session);
            }
        });
    }

    /// Fits the best candidates together with the base. Where each leaves more than mirrors that lack nothing, all the others too: where
    /// the base is fitted without an effect may lie far from where the effect is seen, and slopes do not reach so far. Where none of
    /// all explains the misfit, the best from other time constants as well.
    fn refit(&self, candidates: &mut [Candidate]) {
        let worth = worth_refitting(candidates);
        let fitted = std::slice::from_ref(&self.fitted.model);
        self.refit_from(fitted, &mut candidates[..worth], Precision::Fine);
        if self.is_whole(candidates) {
            return;
        }
        self.refit_from(fitted, &mut candidates[worth..], Precision::Rough);
        if !self.is_explained(candidates) {
            best_first(candidates);
            let restarted = RESTARTED.min(candidates.len());
            let starts = restarts(&self.fitted.model, &identifiable(self.data), self.data);
            self.refit_from(&starts, &mut candidates[..restarted], Precision::Rough);
        }
        self.fit_closely(candidates);
    }

    /// Fits those to the end that explain most and were fitted roughly.
    fn fit_closely(&self, candidates: &mut [Candidate]) {
        best_first(candidates);
        let best = REFITTED.min(candidates.len());
        parallel::map(&mut candidates[..best], |candidate| {
            let rough = candidate.refit.as_ref();
            if let Some(rough) = rough.filter(|refit| refit.precision == Precision::Rough) {
                let mut start = rough.fitted.model.clone();
                start.effects.pop();
                self.refit_one(&[start], candidate, Precision::Fine);
            }
        });
    }

    /// Fits those near the best from other time constants where fits together with the base found less than slopes told: they had stopped in
    /// a local minimum, and another effect may explain what they would.
    fn fit_near_ones_from_elsewhere(&self, candidates: &mut [Candidate]) {
        let worth = worth_refitting(candidates);
        let near = &mut candidates[..worth];
        near.sort_by_key(|candidate| candidate.refit.is_some());
        let stuck = near.partition_point(|candidate| candidate.refit.is_none());
        if stuck == 0 {
            return;
        }
        let starts = restarts(&self.fitted.model, &identifiable(self.data), self.data);
        self.refit_from(&starts, &mut near[..stuck], Precision::Fine);
        best_first(candidates);
    }

    /// Fits what is known to be taken for the best from other time constants, and where the best leaves more than mirrors that lack nothing, that
    /// too: a sensor's lag moves the base's own so far that the fit beside it stops where the film that is squeezed explains more. Each in
    /// all of its forms: which of two whose slopes are alike was scanned best says nothing.
    fn fit_the_best_from_elsewhere(&self, candidates: &mut [Candidate]) {
        let is_whole = self.is_whole(candidates);
        let Some(best) = candidates
            .first()
            .filter(|best| best.score() > best.threshold)
        else {
            return;
        };
        let (best, top) = (best.id().to_owned(), best.score());
        let may_be_it = |candidate: &&mut Candidate| {
            let id = candidate.id();
            let is_far = candidate.score() < RIVAL_SHARE * top;
            let is_it = id == best && !is_whole;
            is_it || is_far && confusions().is_taken(self.channels(), id, &best)
        };
        let suspects: Vec<_> = candidates.iter_mut().filter(may_be_it).collect();
        if suspects.is_empty() {
            return;
        }
        let starts = restarts(&self.fitted.model, &identifiable(self.data), self.data);
        parallel::map(suspects, |candidate| {
            self.refit_one(&starts, candidate, Precision::Fine);
            self.refit_in_better_form(&starts, candidate);
        });
        best_first(candidates);
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

    /// Whether one of these leaves no more than mirrors that lack nothing.
    fn is_whole(&self, candidates: &[Candidate]) -> bool {
        let mut left = candidates
            .iter()
            .map(|candidate| self.misfit - candidate.score().max(0.0));
        left.any(|left| self.null.is_ordinary(left))
    }

    pub(super) fn is_explained(&self, candidates: &[Candidate]) -> bool {
        let mut scores = candidates.iter().map(Candidate::score);
        scores.any(|score| self.null.explains(self.misfit, score.max(0.0)))
    }

    /// Replaces explanations by better ones, fitted together with the base from these starts.
    fn refit_from(&self, starts: &[Model], candidates: &mut [Candidate], precision: Precision) {
        let fitted = Count::of("effects fitted together with the base", candidates.len());
        parallel::map(candidates.iter_mut(), |candidate| {
            self.refit_one(starts, candidate, precision);
            fitted.after(());
        });
    }

    fn refit_one(&self, starts: &[Model], candidate: &mut Candidate, precision: Precision) {
        let Some(so_far) = &candidate.explanation else {
            return;
        };
        // A fit in the ordinary sense may end elsewhere than the best in the session's space.
        match self.refitted(&so_far.active, starts, precision) {
            Some((best, refit)) if best.score > so_far.score => {
                let explanation = best.explanation(so_far.change.clone());
                candidate.take_better(explanation, refit);
            }
            Some((_, refit)) => {
                candidate.keep_lesser(refit, |refit| refit.fitted.cost(self.data));
            }
            None => (),
        }
    }

    /// An effect fitted together with the base from these starts.
    pub(super) fn refitted(
        &self,
        active: &Active,
        starts: &[Model],
        precision: Precision,
    ) -> Option<(Found, Refit)> {
        refit(
            active,
            Strength::Free,
            starts,
            self.data,
            &self.session,
            self.misfit,
            precision,
        )
    }
}

/// Puts those first that are worth a fit together with the base, and counts them.
fn worth_refitting(candidates: &mut [Candidate]) -> usize {
    best_first(candidates);
    let best = candidates.first().map_or(0.0, Candidate::score);
    let is_worth = |candidate: &Candidate| {
        let score = candidate.score();
        score > WORTH_REFITTING * best && score > OF_ITS_THRESHOLD * candidate.threshold
    };
    candidates.sort_by_key(|candidate| !is_worth(candidate));
    candidates.partition_point(is_worth).min(REFITTED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::scored;
    use crate::null_ensemble::NullEnsemble;
    use identification::dataset::{Channel, Dataset};
    use identification::fit::{fit, fit_parameters};
    use identification::prediction::predict;
    use mirror_model::effect::{Active, find};
    use mirror_model::{Preset, Symbol};

    /// Up and down again, displacement and a current read at each level, of this model.
    fn session(truth: &Model) -> Dataset {
        let levels = (0..=14).chain((0..14).rev());
        let held = levels.map(|level| (0.25 * f64::from(level), 1.0));
        let channels = [(Channel::Displacement, 0.02), (Channel::Current(0), 2e-6)];
        let data = Dataset::driven(held).read_at_each(&channels);
        data.with_values(&predict(truth, &data).expect("an answer"))
    }

    fn ensemble(data: &Dataset) -> NullEnsemble {
        NullEnsemble::new(data, &Default::default(), None).expect("an ensemble")
    }

    #[test]
    fn what_is_worth_a_fit_is_near_the_best_and_half_of_what_it_needs() {
        let with_threshold = |threshold: f64, mut candidate: Candidate| {
            candidate.threshold = threshold;
            candidate
        };
        let mut candidates = vec![
            scored("radiation", 39.0),
            with_threshold(100.0, scored("creep", 45.0)),
            with_threshold(100.0, scored("softening", 51.0)),
            scored("hysteresis", 100.0),
        ];
        assert_eq!(worth_refitting(&mut candidates), 2);
        let ids: Vec<_> = candidates.iter().map(Candidate::id).collect();
        assert_eq!(ids, ["hysteresis", "softening", "creep", "radiation"]);
        let mut alike: Vec<_> = (0..REFITTED + 2).map(|_| scored("creep", 7.0)).collect();
        assert_eq!(worth_refitting(&mut alike), REFITTED);
        assert_eq!(worth_refitting(&mut []), 0);
    }

    #[test]
    fn an_effect_is_explained_by_the_strength_that_made_the_readings() {
        let mut truth = Model::from(Preset::Reconciled);
        let effect = find("softening").expect("an effect");
        let mut hidden = Active::usual(effect.clone());
        hidden.values[0] *= 1.4;
        truth.effects.push(hidden.clone());
        let data = session(&truth);
        let fitted = fit(&Model::from(Preset::Reconciled), &data).expect("an answer");
        let ensemble = ensemble(&data);
        let (analysis, mut candidates) =
            Analysis::new(&data, fitted, &ensemble, &[effect]).expect("an answer");
        analysis.explain(&mut candidates);
        let found = candidates[0].explanation.as_ref().expect("it shows");
        let off = found.active.values[0] - hidden.values[0];
        // Two standard errors of what the readings leave open; it is off by six tenths of one.
        assert!(off.abs() < 2.0 * found.slope_error, "{off} of {hidden:?}");
        // The base was fitted as well as it can be.
        assert!(analysis.better_base(&candidates).is_none());
    }

    #[test]
    fn one_that_is_near_the_best_and_was_not_fitted_is_fitted_from_other_time_constants() {
        let mut truth = Model::from(Preset::Reconciled);
        let effect = find("softening").expect("an effect");
        truth.effects.push(Active::usual(effect.clone()));
        let data = session(&truth);
        let fitted = fit(&Model::from(Preset::Reconciled), &data).expect("an answer");
        let ensemble = ensemble(&data);
        let (analysis, mut candidates) =
            Analysis::new(&data, fitted, &ensemble, &[effect]).expect("an answer");
        candidates[0].explanation =
            Scan::new(&candidates[0].directions).explanation(&analysis.residual);
        candidates[0].threshold = 1.0;
        let scanned = candidates[0].score();
        analysis.fit_near_ones_from_elsewhere(&mut candidates);
        assert!(candidates[0].refit.is_some());
        assert!(candidates[0].score() > scanned);
    }

    #[test]
    fn a_base_that_a_fit_with_an_effect_leads_to_is_better_than_one_that_was_not_found() {
        let truth = Model::from(Preset::Reconciled);
        let data = session(&truth);
        let found = fit(&truth, &data).expect("an answer");
        let mut stuck = truth.clone();
        let off = 1.2 * truth.parameters.get(Symbol::CurvatureCoefficient);
        stuck.parameters.set(Symbol::CurvatureCoefficient, off);
        let mut not_found = fit_parameters(&stuck, &data, &data.values(), &[]).expect("an answer");
        not_found.free.clone_from(&found.free);
        let ensemble = ensemble(&data);
        let usual = Active::usual(find("softening").expect("an effect"));
        let (analysis, _) = Analysis::new(&data, not_found, &ensemble, &[]).expect("an answer");
        let (_, refit) = analysis
            .refitted(&usual, &[truth], Precision::Fine)
            .expect("an answer");
        let mut candidate = scored("softening", 100.0);
        candidate.refit = Some(refit);
        let better = analysis.better_base(&[candidate]).expect("there is one");
        // The readings are the model's own: nothing is left, to where a fit ends.
        assert!(better.cost(&data) < 1e-3 * analysis.fitted.cost(&data));
    }
}
