//! The verdict: which effects are above their thresholds, which of them are rivals, and whether they explain the misfit.

use super::analysis::{Analysis, best_first};
use super::notes::{beyond_any_mirror, leave_more, refusal, take_more};
use super::propose::Search;
use super::step_error::step_error;
use super::suspects::{Suspects, ids, least_of};
use crate::candidate::Candidate;
use crate::next;
use crate::proposal::NextMeasurement;
use crate::report::{BeforeAfter, Diagnosis, Form, Verdict, leading};
use identification::fit::Precision;
use identification::prediction::RESOLUTION;
use mirror_model::Runaway;
use std::collections::BTreeMap;

/// An effect that is named scores this share of what a function of any form scores at the best place: nature's form is hardly the
/// candidate's. Set by `cargo xtask bench diagnose -- --whereabouts`, in which effects had 0.98 and more, and laws that no list
/// has 0.81 to 0.94.
const OF_ANY_FORM: f64 = 0.95;

/// The first of two effects explains this share of it by itself: a law that no effect has is explained by two of them as well, of which the
/// first had 45, 55 and 64 % (stiction, a step of the pressure, an end stop of another law). The first of two that were there had 84 % and more.
const OF_TWO: f64 = 0.7;

/// A verdict with what it was found with.
struct Judged {
    verdict: Verdict,
    /// What is named.
    named: Vec<String>,
    /// Whether that is named since it takes most of the error, not all that can be seen.
    is_mostly: bool,
    /// Where it may be, if anything is missing.
    search: Option<Search>,
    /// Why the best effect is not named though it explains the misfit.
    refusal: Option<String>,
}

impl Analysis<'_> {
    /// The verdict, with what it rests on, from candidates with the best first. What is named gets the form that a model is to have.
    pub(super) fn conclude(&self, candidates: &mut [Candidate]) -> Result<Diagnosis, Runaway> {
        let suspects = self.suspects(candidates);
        let Judged {
            verdict,
            named,
            is_mostly,
            search,
            refusal,
        } = self.judged(&suspects, candidates)?;
        let is_unsaid = verdict == Verdict::None && refusal.is_none();
        let unnamed = is_unsaid.then(|| self.why_not_named(&suspects, candidates));
        let unnamed = unnamed.flatten();
        let shows = verdict != Verdict::None || candidates.iter().any(|c| c.score() > c.threshold);
        let odd = shows.then(|| self.odd_file(candidates)).flatten();
        let (odd_file, odd) = odd.unzip();
        // Where nothing is missing nothing is evident either; what is named for the error that it takes has less of a score than others.
        let evident = match verdict {
            Verdict::None => Vec::new(),
            _ if is_mostly => named.clone(),
            _ => ids(&suspects.evident),
        };
        let forms = self.choose_forms(candidates, &named);
        self.fit_named(candidates, &named);
        let of = |ids: &[String]| -> Vec<&Candidate> {
            let is_one = |c: &&Candidate| ids.iter().any(|id| id == c.id());
            candidates.iter().filter(is_one).collect()
        };
        let evident = of(&evident);
        let ranking = parallel::filter_map(candidates.iter(), |candidate| {
            let form = forms.get(candidate.id()).cloned();
            self.ranked(candidate, form, &evident)
        });
        let whereabouts = search.as_ref().and_then(|search| self.whereabouts(search));
        let unexplained = search.filter(|_| verdict == Verdict::Unknown);
        let proposal = unexplained.and_then(|search| self.proposed(&search));
        let invisible = candidates.iter().filter(|c| c.detection_limit().is_none());
        let invisible: Vec<String> = invisible.map(|c| c.id().to_owned()).collect();
        let is_blind = 2 * invisible.len() > candidates.len();
        let of_named = of(&named);
        let alone = of_named.first().filter(|_| verdict == Verdict::Named);
        let remainder = alone.and_then(|alone| self.left_of(alone, is_mostly));
        let larger = remainder.and_then(|left| take_more(&left, &ranking));
        let effective = candidates.iter().filter(|c| self.has_an_effect(c));
        let leaving = leave_more(&of_named, &evident, &ranking);
        let beyond = beyond_any_mirror(&of_named, &effective.collect::<Vec<_>>());
        let error = self.error();
        Ok(Diagnosis {
            verdict,
            discrepancy_rms: self.discrepancy_rms(),
            error_rms: leading(&ranking, &named).map_or(
                BeforeAfter {
                    before: error.value,
                    after: error.value,
                    unit: error.unit,
                },
                |best| best.error_rms,
            ),
            remainder,
            whereabouts,
            proposal,
            misfit: self.misfit / self.null.median(),
            solver_error: step_error(&self.fitted.model, self.data, RESOLUTION)?,
            next_measurement: self
                .next_measurement(&of_named, verdict == Verdict::None && is_blind),
            effects: named,
            invisible,
            infeasible: candidates
                .iter()
                .filter(|c| c.is_infeasible())
                .map(|c| c.id().to_owned())
                .collect(),
            ranking,
            thinned_rows: self.data.thinned_rows,
            odd_file,
            notes: odd
                .into_iter()
                .chain(refusal)
                .chain(self.notes(verdict))
                .chain(unnamed)
                .chain(larger)
                .chain(leaving)
                .chain(beyond)
                .collect(),
        })
    }

    /// The forms of what is named, by their names.
    fn choose_forms(
        &self,
        candidates: &mut [Candidate],
        named: &[String],
    ) -> BTreeMap<String, Form> {
        let forms = parallel::filter_map(of_names(candidates, named), |candidate| {
            Some((candidate.id().to_owned(), self.choose_form(candidate)?))
        });
        best_first(candidates);
        forms.into_iter().collect()
    }

    /// Fits what is named together with the base.
    fn fit_named(&self, candidates: &mut [Candidate], named: &[String]) {
        parallel::map(of_names(candidates, named), |candidate| {
            self.fit_with_base(candidate);
        });
    }

    /// Fits a candidate together with the base where slopes alone explained more: what is told of its errors is what a model has that the
    /// effect is added to.
    pub(super) fn fit_with_base(&self, candidate: &mut Candidate) {
        if candidate.refit.is_none() {
            candidate.refit = candidate.lesser_refit.take();
        }
        let (None, Some(explanation)) = (&candidate.refit, &candidate.explanation) else {
            return;
        };
        let start = std::slice::from_ref(&self.fitted.model);
        let fitted = self.refitted(&explanation.active, start, Precision::Fine);
        candidate.refit = fitted.map(|(_, refit)| refit);
    }

    /// Whether the rivals are named: where they explain the misfit, and no free-form function at some place explains clearly more,
    /// which would be a form that no effect has, unless the first of them and a second effect explain more than any function at one
    /// place, which is what two effects do; or where one effect takes most of the error.
    fn judged(&self, suspects: &Suspects, candidates: &[Candidate]) -> Result<Judged, Runaway> {
        let rivals = &suspects.rivals;
        let best = rivals.first().filter(|best| self.follows_with(best));
        let explained = best.and_then(|best| self.explained_by(best, candidates));
        let is_exceeded = self.null.is_exceeded_by(self.misfit) || !self.follows();
        let mostly = match &rivals[..] {
            _ if explained.is_some() => None,
            [alone] if best.is_some() && self.takes_most(alone) => Some(alone.id().to_owned()),
            _ if is_exceeded => self.the_one_that_takes_most(&suspects.evident),
            _ => None,
        };
        let is_searched = explained.is_some() || mostly.is_some() || is_exceeded;
        let search = is_searched.then(|| self.search()).transpose()?;
        let first = rivals.first().zip(explained);
        let any_form = search.as_ref().and_then(Search::best);
        let refused = first
            .zip(any_form)
            .filter(|((effect, explained), any_form)| {
                let with_second = || self.with_second(effect, candidates);
                falls_short(any_form.score, effect.score(), *explained, with_second)
            });
        // What is evidently there, and of a form that no effect has, is missing however little is left.
        let is_of_another_form =
            refused.is_some_and(|(_, any_form)| any_form.score > any_form.threshold);
        let refusal = refused.map(|((effect, _), better)| refusal(effect, better));
        let is_its_form = explained.is_some() && refusal.is_none();
        let verdict = verdict(
            if mostly.is_some() { 1 } else { rivals.len() },
            is_its_form || mostly.is_some(),
            is_exceeded || is_of_another_form,
        );
        let is_named = matches!(verdict, Verdict::Named | Verdict::Ambiguous);
        let of_rivals = || if is_named { ids(rivals) } else { Vec::new() };
        Ok(Judged {
            verdict,
            is_mostly: mostly.is_some(),
            named: mostly.map_or_else(of_rivals, |mostly| vec![mostly]),
            search: search.filter(|_| verdict != Verdict::None),
            refusal,
        })
    }

    fn next_measurement(&self, named: &[&Candidate], is_blind: bool) -> Option<NextMeasurement> {
        let next = if named.len() > 1 {
            let rivals = named.iter().filter_map(|c| c.explanation.as_ref());
            let rivals: Vec<_> = rivals.map(|e| e.active.clone()).collect();
            next::choose(&self.fitted.model, self.data, &rivals)
        } else if is_blind {
            next::more(self.data)
        } else {
            None
        };
        next.map(|next| next.in_the_room(self.data.first_ambient_c))
    }

    /// The score of an effect, or of it and a second one, that leaves no more than what mirrors that lack nothing leave.
    fn explained_by(&self, best: &Candidate, candidates: &[Candidate]) -> Option<f64> {
        let explains = |score: &f64| self.null.explains(self.misfit, *score);
        Some(best.score())
            .filter(explains)
            .or_else(|| Some(self.with_second(best, candidates)).filter(explains))
    }

    /// The score of an effect, and of the best second one beside it.
    fn with_second(&self, best: &Candidate, candidates: &[Candidate]) -> f64 {
        best.score() + self.second(best, candidates)
    }

    /// The best score of another effect in what the first one leaves, where it counts: two effects may be missing.
    fn second(&self, best: &Candidate, candidates: &[Candidate]) -> f64 {
        let left = best
            .explanation
            .as_ref()
            .map(|e| &self.residual - &e.change);
        let score = |other: &Candidate| match &best.refit {
            Some(refit) => Some(other.scanned(&refit.left, &refit.space)?.score),
            None => Some(other.scanned(left.as_ref()?, &self.session)?.score),
        };
        let others = candidates.iter().filter(|c| c.id() != best.id());
        let missing =
            parallel::filter_map(others, |c| score(c).filter(|score| *score > c.threshold));
        missing.into_iter().fold(0.0, f64::max)
    }
}

/// The candidates of these names.
fn of_names<'a>(
    candidates: &'a mut [Candidate],
    names: &'a [String],
) -> impl Iterator<Item = &'a mut Candidate> {
    let is_named = |c: &&mut Candidate| names.iter().any(|id| id == c.id());
    candidates.iter_mut().filter(is_named)
}

/// The least score of an effect that is named, where a function of any form scores so much.
fn least_beside(any_form: f64) -> f64 {
    least_of(OF_ANY_FORM, any_form)
}

/// Whether a function of any form that scores so much has a form that no effect has: the first effect scores too little beside it, by
/// itself, or in what `explained` the misfit and together with the best second one.
fn falls_short(
    any_form: f64,
    alone: f64,
    explained: f64,
    with_second: impl FnOnce() -> f64,
) -> bool {
    let is_of_another_law = alone < OF_TWO * any_form;
    is_of_another_law || explained < least_beside(any_form) && with_second() < any_form
}

/// The outcome, from the number of rivals, whether they explain the misfit, and whether the misfit is more than mirrors
/// that lack nothing show.
fn verdict(rivals: usize, is_explained: bool, is_exceeded: bool) -> Verdict {
    match rivals {
        1 if is_explained => Verdict::Named,
        2.. if is_explained => Verdict::Ambiguous,
        _ if is_exceeded => Verdict::Unknown,
        _ => Verdict::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_needs_an_explanation() {
        assert_eq!(verdict(1, true, true), Verdict::Named);
        assert_eq!(verdict(3, true, false), Verdict::Ambiguous);
        assert_eq!(verdict(1, false, true), Verdict::Unknown);
        assert_eq!(verdict(2, false, false), Verdict::None);
        assert_eq!(verdict(0, false, true), Verdict::Unknown);
        assert_eq!(verdict(0, false, false), Verdict::None);
    }

    #[test]
    fn two_effects_are_named_for_a_law_only_where_the_first_explains_most_of_it() {
        let falls_short = |alone, explained, both| falls_short(1000.0, alone, explained, || both);
        assert!(!falls_short(960.0, 960.0, 960.0), "its own form");
        assert!(!falls_short(840.0, 840.0, 1100.0), "two that were there");
        assert!(falls_short(840.0, 840.0, 990.0), "no second one");
        // An end stop of another law, which two effects explain.
        assert!(falls_short(640.0, 1100.0, 1100.0));
    }

    #[test]
    fn a_name_explains_about_what_any_function_does() {
        assert_eq!(least_beside(1000.0), 950.0);
        assert_eq!(least_beside(100.0), 88.0);
    }
}
