//! Which form of an effect it is that explains a session, and which others would as well.

use super::Analysis;
use crate::candidate::{Candidate, PRICE, refit, scan};
use crate::report::Form;
use mirror_model::effect::{Active, forms};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A form whose score is this share of the best one's, or is less by no more than two parameters' price, cannot be told from
/// it: as rivals are.
const ALIKE: f64 = 0.92;

impl Analysis<'_> {
    /// The best form of a candidate, and those that cannot be told from it; none where there is one form only.
    pub(super) fn form(&self, candidate: &Candidate) -> Option<Form> {
        let best = candidate.explanation.as_ref()?;
        let name = best.active.effect.form();
        let others: BTreeSet<String> = forms(&candidate.effect)
            .iter()
            .map(|form| form.form().to_owned())
            .filter(|form| form != name)
            .collect();
        if others.is_empty() {
            return None;
        }
        let enough = hardly_less_than(best.score);
        let alike = others.into_par_iter().filter(|form| {
            let score = self.score_of(candidate, form);
            score.is_some_and(|score| score > enough)
        });
        Some(Form {
            name: name.to_owned(),
            alike: alike.collect(),
        })
    }

    /// The score of a candidate in one of its forms, fitted together with the base.
    fn score_of(&self, candidate: &Candidate, form: &str) -> Option<f64> {
        let directions: Vec<_> = candidate.directions_of(form).cloned().collect();
        let scanned = scan(&directions, &self.residual);
        let usual = || Some(directions.first()?.active.clone());
        let active: Active = scanned.map(|e| e.active).or_else(usual)?;
        let starts = match &candidate.refit {
            Some(with_best) => {
                let mut model = with_best.fitted.model.clone();
                model.effects.pop();
                vec![model, self.fitted.model.clone()]
            }
            None => vec![self.fitted.model.clone()],
        };
        let fits = starts.iter().filter_map(|model| {
            let (found, _) = refit(&active, model, self.data, &self.session, self.misfit)?;
            Some(found.score)
        });
        fits.max_by(f64::total_cmp)
    }
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
