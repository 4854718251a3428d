//! Where something is missing, without a list of effects; and a form for what no known effect explains: the best of the drafted
//! formulas, fitted together with the base as effects are.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, PRICE, refine, refit};
use crate::formula_search::{Draft, drafts, effect, id, sentence};
use crate::report::{ProposedForm, Verdict};
use crate::residual_space::Session;
use crate::whereabouts::{self, Reach, Searched, Sharpness, Whereabouts};
use mirror_model::Runaway;
use mirror_model::effect::{Active, Formula};
use rayon::prelude::*;
use std::sync::Arc;

impl Analysis<'_> {
    /// Where something is missing, if anything is; and where no known effect explains it, a form for it.
    pub(super) fn whereabouts(
        &self,
        verdict: Verdict,
    ) -> Result<(Option<Whereabouts>, Option<ProposedForm>), Runaway> {
        if verdict == Verdict::None {
            return Ok((None, None));
        }
        let at = self.operating();
        let (reach, searched) = whereabouts::search(
            at,
            &self.session,
            &self.residual,
            &self.left_out,
            &self.null,
        )?;
        let sharpness = Sharpness::shipped().with(self.channels());
        let told = whereabouts::conclude(&searched, sharpness);
        let is_unknown = verdict == Verdict::Unknown;
        let proposed = is_unknown.then(|| self.proposed(&reach, &searched));
        Ok((told, proposed.flatten()))
    }

    /// The formula that explains most of a session after its price, where mirrors that lack nothing have none as good, and the
    /// error falls with it, on readings held out too.
    fn proposed(&self, reach: &Reach, searched: &[Searched]) -> Option<ProposedForm> {
        let (drafts, threshold) = drafts(searched, reach, &self.null);
        let fitted = drafts
            .par_iter()
            .filter_map(|draft| Some((draft, self.tried(draft, threshold)?)));
        let worth = |(draft, candidate): &(&Draft, Candidate)| {
            candidate.score() - PRICE * draft.law.operators() as f64
        };
        let fitted: Vec<(&Draft, Candidate)> = fitted.collect();
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
            score: candidate.score(),
            threshold,
            error_rms: self.before_and_after(&candidate, explanation, self.unit()),
            held_out_rms: self.held_out(&candidate, explanation, self.unit()),
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
        let from = &self.fitted.model;
        let (found, refit) = refit(&refined.active, from, self.data, &self.session, self.misfit)?;
        Some(Candidate {
            threshold,
            explanation: Some(found.explanation(refined.change)),
            refit: Some(refit),
            ..Candidate::new(effect, Vec::new())
        })
    }
}
