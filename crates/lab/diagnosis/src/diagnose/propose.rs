//! Where something is missing, without a list of effects; and a form for what no known effect explains: the best of the drafted
//! formulas, fitted together with the base as effects are.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, PRICE, refine};
use crate::formula_search::{Draft, drafts, effect, id, sentence};
use crate::progress::Count;
use crate::report::ProposedForm;
use crate::residual_space::Session;
use crate::whereabouts::{self, Located, Reach, Searched, Sharpness, Whereabouts};
use identification::fit::Precision;
use mirror_model::Runaway;
use mirror_model::effect::{Active, Formula};
use std::sync::Arc;

/// The places that were searched, the best first.
pub(super) struct Search {
    reach: Reach,
    searched: Vec<Searched>,
}

impl Search {
    /// The place where a free-form function explains most, if there is any.
    pub(super) fn best(&self) -> Option<&Located> {
        self.searched.first().map(|s| &s.located)
    }
}

impl Analysis<'_> {
    /// Searches all places where something may be missing.
    pub(super) fn search(&self) -> Result<Search, Runaway> {
        log::info!("searching where it is, without the list of effects");
        let at = self.operating();
        let (reach, searched) = whereabouts::search(
            at,
            &self.session,
            &self.residual,
            &self.left_out,
            &self.null,
        )?;
        Ok(Search { reach, searched })
    }

    /// Where something is missing, if anything is.
    pub(super) fn whereabouts(&self, search: &Search) -> Option<Whereabouts> {
        let sharpness = Sharpness::shipped().with(self.channels());
        whereabouts::conclude(&search.searched, sharpness)
    }

    /// The formula that explains most of a session after its price, where mirrors that lack nothing have none as good, and the
    /// error falls with it, on readings held out too.
    pub(super) fn proposed(&self, search: &Search) -> Option<ProposedForm> {
        let (drafts, threshold) = drafts(&search.searched, &search.reach, &self.null);
        let count = Count::of("formulas fitted", drafts.len());
        let fitted = parallel::filter_map(&drafts, |draft| {
            Some((draft, count.after(self.tried(draft, threshold))?))
        });
        let worth = |(draft, candidate): &(&Draft, Candidate)| {
            candidate.score() - PRICE * draft.law.operators() as f64
        };
        let (draft, candidate) = fitted
            .into_iter()
            .filter(|tried| worth(tried) > threshold)
            .filter(|tried| self.has_an_effect(&tried.1) && self.is_shown_on_others(&tried.1))
            .max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
        let explanation = candidate.explanation.as_ref()?;
        let values = &candidate
            .refit
            .as_ref()?
            .fitted
            .model
            .effects
            .last()?
            .values;
        Some(ProposedForm {
            effect: id(draft.place),
            text: effect(draft, Some(values)),
            sentence: sentence(draft, values),
            stage: draft.place.stage(),
            score: candidate.score(),
            threshold,
            error_rms: self.before_and_after(&candidate, explanation, self.unit()),
            held_out_rms: self.held_out(&candidate, explanation, self.unit()),
            current_rms: self.currents_before_and_after(&candidate, explanation),
        })
    }

    /// A draft as a candidate, refined and fitted together with the base.
    fn tried(&self, draft: &Draft, threshold: f64) -> Option<Candidate> {
        let text = effect(draft, None);
        let formula = Formula::parse("proposed", &text).ok()?;
        let effect: Arc<dyn mirror_model::effect::Effect> = Arc::new(formula);
        let active = Active::usual(effect.clone());
        let change = self.session.vector(&self.operating().change(&active).ok()?);
        let start: Explanation<Session> = Explanation {
            score: 0.0,
            slope_error: f64::INFINITY,
            change,
            active,
        };
        let refined = refine(&start, self.operating(), &self.residual, &self.session);
        let from = std::slice::from_ref(&self.fitted.model);
        let (found, refit) = self.refitted(&refined.active, from, Precision::Fine)?;
        Some(Candidate {
            threshold,
            explanation: Some(found.explanation(refined.change)),
            refit: Some(refit),
            ..Candidate::new(effect, Vec::new())
        })
    }
}
