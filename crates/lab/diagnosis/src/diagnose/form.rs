//! Which form of an effect it is that explains a session, and which others would as well.

use super::analysis::{Analysis, best_first};
use super::explain::WORTH_REFITTING;
use crate::candidate::{Candidate, Explanation, InForm, PRICE, Scan, is_plausible, refine};
use crate::report::Form;
use crate::residual_space::Session;
use identification::fit::Precision;
use mirror_model::Model;
use mirror_model::effect::{Effect, forms};
use std::sync::Arc;

/// A form whose score is this share of the best one's, or is less by no more than two parameters' price, cannot be told from
/// it: as rivals are.
const ALIKE: f64 = 0.92;

impl Analysis<'_> {
    /// Fits each candidate that leads in all of its forms, and has it in the one that explains most: the form whose slopes explain
    /// most may not be it, least of all where it ends at an end of its range. Where none explains the misfit all are: in a form that is not
    /// nature's a sensor's lag scored a twentieth of what a resonance did, or nothing.
    pub(super) fn fit_leading_forms(&self, candidates: &mut [Candidate]) {
        let most = candidates.iter().map(Candidate::score).fold(0.0, f64::max);
        let is_explained = self.is_explained(candidates);
        let leads = |c: &&mut Candidate| {
            !is_explained || c.score() > c.threshold.max(WORTH_REFITTING * most)
        };
        let leading = candidates.iter_mut().filter(leads);
        parallel::map(leading, |candidate| self.fit_forms(candidate));
        best_first(candidates);
    }

    /// Fits a candidate in all of its forms, if that was not done yet, and has it in the one that explains most; where that would have to
    /// be greater than any mirror has, in one that would not and cannot be told from it.
    fn fit_forms(&self, candidate: &mut Candidate) {
        if candidate.other_forms.is_some() {
            return;
        }
        let others = other_forms(candidate);
        let in_form = |form: &Arc<dyn Effect>| self.in_form(candidate, form.form());
        let mut fitted = parallel::filter_map(&others, in_form);
        let (refit, lesser_refit) = (candidate.refit.take(), candidate.lesser_refit.take());
        fitted.extend(candidate.explanation.take().map(|explanation| InForm {
            explanation,
            refit,
            lesser_refit,
        }));
        fitted.sort_by(|a, b| b.explanation.score.total_cmp(&a.explanation.score));
        if let Some(best) = fitted.first() {
            let least = hardly_less_than(best.explanation.score);
            let may_be = |form: &InForm| {
                form.explanation.score > least && is_plausible(&form.explanation.active)
            };
            let chosen = fitted.iter().position(may_be).unwrap_or(0);
            candidate.take(fitted.remove(chosen));
        }
        candidate.other_forms = Some(fitted);
    }

    /// Takes, of the forms of an effect that cannot be told from the best one, one that the control core inverts: what a model has
    /// is what the board can take out. Says which form it is then; none where there is one form only.
    pub(super) fn choose_form(&self, candidate: &mut Candidate) -> Option<Form> {
        if forms(&candidate.effect).len() < 2 {
            return None;
        }
        self.fit_forms(candidate);
        let best = candidate.explanation.clone()?;
        let others = candidate.other_forms.take()?;
        let is_alike = |other: &InForm| self.is_as_good(&other.explanation, &best);
        let (mut alike, worse): (Vec<_>, Vec<_>) = others.into_iter().partition(is_alike);
        let is_inverted = |e: &Explanation<Session>| e.active.effect.is_inverted();
        let names = |of: &[InForm]| of.iter().map(|other| name(&other.explanation)).collect();
        let chosen = match is_inverted(&best) {
            true => None,
            false => alike
                .iter()
                .position(|other| is_inverted(&other.explanation)),
        };
        if let Some(chosen) = chosen {
            let chosen = alike.remove(chosen);
            let mut alike: Vec<String> = names(&alike);
            alike.insert(0, name(&best));
            let form = Form {
                name: name(&chosen.explanation),
                alike,
                inverted: None,
            };
            candidate.take(chosen);
            return Some(form);
        }
        let inverted = worse
            .iter()
            .find(|other| !is_inverted(&best) && is_inverted(&other.explanation));
        Some(Form {
            name: name(&best),
            alike: names(&alike),
            inverted: inverted.map(|other| name(&other.explanation)),
        })
    }

    /// Whether a form cannot be told from a better one: by its score, and by whether it explains what the other explains.
    fn is_as_good(&self, form: &Explanation<Session>, best: &Explanation<Session>) -> bool {
        let explains = |e: &Explanation<Session>| self.null.explains(self.misfit, e.score.max(0.0));
        form.score > hardly_less_than(best.score) && (explains(form) || !explains(best))
    }

    /// Has a candidate in another of its forms where that explains more, fitted together with the base from these starts.
    pub(super) fn refit_in_better_form(&self, starts: &[Model], candidate: &mut Candidate) {
        for form in other_forms(candidate) {
            let other = self.in_form_from(candidate, form.form(), starts);
            let other = other.filter(|other| other.explanation.score > candidate.score());
            if let Some(better) = other {
                candidate.take(better);
            }
        }
    }

    /// A candidate in one of its forms, refined and fitted together with the base, as every candidate is.
    fn in_form(&self, candidate: &Candidate, form: &str) -> Option<InForm> {
        let starts = match &candidate.refit {
            Some(with_best) => {
                let mut model = with_best.fitted.model.clone();
                model.effects.pop();
                vec![model, self.fitted.model.clone()]
            }
            None => vec![self.fitted.model.clone()],
        };
        self.in_form_from(candidate, form, &starts)
    }

    fn in_form_from(&self, candidate: &Candidate, form: &str, starts: &[Model]) -> Option<InForm> {
        let start = self.refined_in_form(candidate, form)?;
        Some(
            match self.refitted(&start.active, starts, Precision::Fine) {
                Some((found, refit)) if found.score > start.score => InForm {
                    explanation: found.explanation(start.change),
                    refit: Some(refit),
                    lesser_refit: None,
                },
                lesser => InForm {
                    explanation: start,
                    refit: None,
                    lesser_refit: lesser.map(|(_, refit)| refit),
                },
            },
        )
    }

    /// A form's explanation from where it is scanned best, or from its usual size where that changes hardly anything.
    fn refined_in_form(&self, candidate: &Candidate, form: &str) -> Option<Explanation<Session>> {
        let directions: Vec<_> = candidate.directions_of(form).cloned().collect();
        let usual = || {
            directions.first().map(|first| Explanation {
                active: first.active.clone(),
                score: f64::NEG_INFINITY,
                change: first.change.clone(),
                slope_error: f64::INFINITY,
            })
        };
        let start = Scan::new(&directions)
            .explanation(&self.residual)
            .or_else(usual)?;
        Some(match self.data.is_one_heater() {
            // Slopes of the base do not reach as far.
            true => start,
            false => refine(&start, self.operating(), &self.residual, &self.session),
        })
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
    use crate::null_ensemble::NullEnsemble;
    use identification::dataset::{Channel, Dataset};
    use identification::fit::fit;
    use identification::prediction::predict;
    use mirror_model::effect::{Active, find};
    use mirror_model::{Model, Preset};

    #[test]
    fn a_leading_candidate_gets_the_form_that_made_the_readings() {
        let effect = find("heat-loss-temperature").expect("an effect");
        let all = forms(&effect);
        // Of its forms the one that is steepest where the heater is coldest, three times as strong as usual.
        let hidden = all.iter().find(|form| form.form() == "convection");
        let hidden = hidden.expect("a form");
        let mut active = Active::usual(hidden.clone());
        active.values[0] *= 3.0;
        let mut truth = Model::from(Preset::Reconciled);
        truth.effects.push(active);
        let levels = (0..=14).map(|level| (0.25 * f64::from(level), 1.0));
        let channels = [(Channel::Displacement, 0.02), (Channel::Current(0), 2e-6)];
        let data = Dataset::driven(levels).read_at_each(&channels);
        let data = data.with_values(&predict(&truth, &data).expect("an answer"));
        let fitted = fit(&Model::from(Preset::Reconciled), &data).expect("an answer");
        let ensemble = NullEnsemble::new(&data, &Default::default(), None).expect("an ensemble");
        let effects = std::slice::from_ref(&effect);
        let (analysis, mut candidates) =
            Analysis::new(&data, fitted, &ensemble, effects).expect("an answer");
        let first = analysis.in_form(&candidates[0], all[0].form());
        candidates[0].take(first.expect("it explains something"));
        candidates[0].threshold = 0.0;
        analysis.fit_leading_forms(&mut candidates);
        let [candidate] = &candidates[..] else {
            panic!("one");
        };
        let best = candidate.explanation.as_ref().expect("it shows");
        assert_eq!(best.active.effect.form(), hidden.form());
        let others = candidate.other_forms.as_ref().expect("they were fitted");
        assert!(
            others
                .iter()
                .all(|other| other.explanation.score < best.score)
        );
        assert_eq!(others.len(), all.len() - 1);
    }

    #[test]
    fn a_share_of_a_high_score_and_two_parameters_of_a_low_one_tell_nothing() {
        assert_eq!(PRICE, 6.0);
        assert_eq!(hardly_less_than(1000.0), 920.0);
        assert_eq!(hardly_less_than(100.0), 88.0);
    }
}
