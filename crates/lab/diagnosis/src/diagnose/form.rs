//! Which form of an effect it is that explains a session, and which others would as well.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, PRICE, Refit, refit, scan};
use crate::report::Form;
use crate::residual_space::Session;
use mirror_model::effect::{Active, Effect, forms};
use rayon::prelude::*;
use std::sync::Arc;

/// A form whose score is this share of the best one's, or is less by no more than two parameters' price, cannot be told from
/// it: as rivals are.
const ALIKE: f64 = 0.92;

impl Analysis<'_> {
    /// The best form of a candidate, and those that cannot be told from it; none where there is one form only.
    pub(super) fn form(&self, candidate: &Candidate) -> Option<Form> {
        let best = candidate.explanation.as_ref()?;
        let others = other_forms(candidate);
        if others.is_empty() {
            return None;
        }
        let alike = others.par_iter().filter(|form| {
            let other = self.in_form(candidate, form.form());
            other.is_some_and(|(other, _)| self.is_as_good(&other, best))
        });
        let alike: Vec<String> = alike.map(|form| form.form().to_owned()).collect();
        let inverted = others.iter().find(|form| form.is_inverted());
        let inverted = inverted.filter(|_| !best.active.effect.is_inverted());
        Some(Form {
            name: best.active.effect.form().to_owned(),
            alike,
            inverted: inverted.map(|form| form.form().to_owned()),
        })
    }

    /// Takes, of forms that cannot be told apart, the one that the control core inverts: what a model has is what the board can
    /// take out.
    pub(super) fn prefer_inverted(&self, candidate: &mut Candidate) {
        let Some(best) = &candidate.explanation else {
            return;
        };
        if best.active.effect.is_inverted() {
            return;
        }
        let others = other_forms(candidate);
        let inverted = others.iter().filter(|form| form.is_inverted());
        let fits = inverted.filter_map(|form| self.in_form(candidate, form.form()));
        let alike = fits.filter(|(other, _)| self.is_as_good(other, best));
        let preferred = alike.max_by(|(a, _), (b, _)| a.score.total_cmp(&b.score));
        if let Some((explanation, refit)) = preferred {
            candidate.explanation = Some(explanation);
            candidate.refit = Some(refit);
        }
    }

    /// Whether a form cannot be told from a better one: by its score, and by whether it explains what the other explains.
    fn is_as_good(&self, form: &Explanation<Session>, best: &Explanation<Session>) -> bool {
        let explains = |e: &Explanation<Session>| self.null.explains(self.misfit, e.score.max(0.0));
        form.score > hardly_less_than(best.score) && (explains(form) || !explains(best))
    }

    /// A candidate in one of its forms, fitted together with the base.
    fn in_form(&self, candidate: &Candidate, form: &str) -> Option<(Explanation<Session>, Refit)> {
        let directions: Vec<_> = candidate.directions_of(form).cloned().collect();
        let scanned = scan(&directions, &self.residual);
        let usual = || {
            let first = directions.first()?;
            Some((first.active.clone(), first.change.clone()))
        };
        let scanned = scanned.map(|e| (e.active, e.change));
        let (active, change): (Active, _) = scanned.or_else(usual)?;
        let starts = match &candidate.refit {
            Some(with_best) => {
                let mut model = with_best.fitted.model.clone();
                model.effects.pop();
                vec![model, self.fitted.model.clone()]
            }
            None => vec![self.fitted.model.clone()],
        };
        let fits = starts
            .iter()
            .filter_map(|model| refit(&active, model, self.data, &self.session, self.misfit));
        let (found, refit) = fits.max_by(|(a, _), (b, _)| a.score.total_cmp(&b.score))?;
        Some((found.explanation(change), refit))
    }
}

/// The forms of an effect that do not explain a session best.
fn other_forms(candidate: &Candidate) -> Vec<Arc<dyn Effect>> {
    let best = candidate
        .explanation
        .as_ref()
        .map(|e| e.active.effect.form());
    let mut others = forms(&candidate.effect);
    others.retain(|form| Some(form.form()) != best);
    others
}

/// Above this a score cannot be told from the best one.
fn hardly_less_than(best: f64) -> f64 {
    (ALIKE * best).min(best - 2.0 * PRICE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_a_high_score_and_two_parameters_of_a_low_one_tell_nothing() {
        assert_eq!(PRICE, 6.0);
        assert_eq!(hardly_less_than(1000.0), 920.0);
        assert_eq!(hardly_less_than(100.0), 88.0);
    }
}
