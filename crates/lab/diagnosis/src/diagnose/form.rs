//! Which form of an effect it is that explains a session, and which others would as well.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, PRICE, Refit, scan};
use crate::report::Form;
use crate::residual_space::Session;
use identification::fit::Precision;
use mirror_model::effect::{Active, Effect, forms};
use rayon::prelude::*;
use std::sync::Arc;

/// A form whose score is this share of the best one's, or is less by no more than two parameters' price, cannot be told from
/// it: as rivals are.
const ALIKE: f64 = 0.92;

impl Analysis<'_> {
    /// Takes, of the forms of an effect that cannot be told from the best one, one that the control core inverts: what a model has
    /// is what the board can take out. Says which form it is then; none where there is one form only.
    pub(super) fn choose_form(&self, candidate: &mut Candidate) -> Option<Form> {
        let best = candidate.explanation.clone()?;
        let others = other_forms(candidate);
        if others.is_empty() {
            return None;
        }
        let is_alike = |(other, _): &(Explanation<Session>, Refit)| self.is_as_good(other, &best);
        let alike: Vec<_> = others
            .par_iter()
            .filter_map(|form| self.in_form(candidate, form.form()).filter(is_alike))
            .collect();
        let mut alike_names: Vec<String> = alike.iter().map(|(e, _)| name(e)).collect();
        let is_inverted = |e: &Explanation<Session>| e.active.effect.is_inverted();
        if is_inverted(&best) {
            return Some(Form {
                name: name(&best),
                alike: alike_names,
                inverted: None,
            });
        }
        let inverted = alike.into_iter().filter(|(e, _)| is_inverted(e));
        match inverted.max_by(|(a, _), (b, _)| a.score.total_cmp(&b.score)) {
            Some((explanation, refit)) => {
                let chosen = name(&explanation);
                alike_names.retain(|other| *other != chosen);
                alike_names.insert(0, name(&best));
                candidate.explanation = Some(explanation);
                candidate.refit = Some(refit);
                Some(Form {
                    name: chosen,
                    alike: alike_names,
                    inverted: None,
                })
            }
            None => Some(Form {
                name: name(&best),
                alike: alike_names,
                inverted: others
                    .iter()
                    .find(|form| form.is_inverted())
                    .map(|form| form.form().to_owned()),
            }),
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
        let (found, refit) = self.refitted(&active, &starts, Precision::Fine)?;
        Some((found.explanation(change), refit))
    }
}

fn name(explanation: &Explanation<Session>) -> String {
    explanation.active.effect.form().to_owned()
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
