//! The verdict: which effects are above their thresholds, which of them are rivals, and whether they explain the misfit.

use super::{Bench, Trial, best_first, is_plausible, rms};
use crate::candidate::{Explanation, scan};
use crate::confusions::{Channels, confusions};
use crate::ensemble::solver_error;
use crate::fit::RESOLUTION;
use crate::next;
use crate::report::{BeforeAfter, Diagnosis, Verdict};
use mirror_model::Runaway;
use rayon::prelude::*;

/// Candidates this close to the best score are rivals however small both are.
const RIVAL_MARGIN: f64 = 12.0;

impl Bench<'_> {
    /// The verdict, with what it rests on.
    pub(super) fn conclude(&self, trial: Trial) -> Result<Diagnosis, Runaway> {
        let order = best_first(&trial.explanations);
        let explanation = |i: usize| {
            trial.explanations[i]
                .as_ref()
                .expect("only explained effects are ordered")
        };
        let above: Vec<usize> = order
            .iter()
            .copied()
            .filter(|&i| explanation(i).score > self.calm.thresholds[i])
            .filter(|&i| is_plausible(&explanation(i).active))
            .collect();
        let rivals = self.rivals(&above, &explanation);
        let verdict = self.verdict(&trial, &rivals, &explanation);
        let named = if matches!(verdict, Verdict::Named | Verdict::Ambiguous) {
            rivals
        } else {
            Vec::new()
        };
        let ranking: Vec<_> = order
            .par_iter()
            .map(|&i| self.ranked(i, explanation(i), &above, &explanation))
            .collect();
        let is_seen = |id: &String| {
            let mut seen = ranking.iter().filter(|r| r.detection_limit.is_some());
            seen.any(|ranked| ranked.effect == *id)
        };
        let invisible: Vec<String> = (0..self.effects.len())
            .map(|i| self.id(i))
            .filter(|id| !is_seen(id))
            .collect();
        let next_measurement = if named.len() > 1 {
            let rivals: Vec<_> = named
                .iter()
                .map(|&i| explanation(i).active.clone())
                .collect();
            next::choose(&self.fitted.model, self.plan, &rivals)
        } else if verdict == Verdict::None && 2 * invisible.len() > self.effects.len() {
            next::more(self.plan)
        } else {
            None
        };
        let error = rms(self.plan, self.fitted.scaled(self.plan).iter().copied());
        Ok(Diagnosis {
            verdict,
            effects: named.iter().map(|&i| self.id(i)).collect(),
            approximation_rms_um: self.approximation_rms,
            unit: if self.plan.has_displacement() {
                "um"
            } else {
                "mA"
            },
            error_rms_um: ranking.first().map_or(
                BeforeAfter {
                    before: error,
                    after: error,
                },
                |best| best.error_rms_um,
            ),
            misfit: trial.misfit / self.calm.misfit(0.5),
            solver_error: solver_error(&self.fitted.model, self.plan, RESOLUTION)?,
            invisible,
            ranking,
            next_measurement,
        })
    }

    fn rivals<'e>(
        &self,
        above: &[usize],
        explanation: &impl Fn(usize) -> &'e Explanation,
    ) -> Vec<usize> {
        let Some(&best) = above.first() else {
            return Vec::new();
        };
        let top = explanation(best).score;
        let channels = Channels::of(self.plan);
        let is_rival = |&i: &usize| {
            let share = confusions().rival_share(channels, &self.id(i), &self.id(best));
            explanation(i).score > (share * top).min(top - RIVAL_MARGIN)
        };
        above.iter().copied().filter(is_rival).collect()
    }

    fn verdict<'e>(
        &self,
        trial: &Trial,
        rivals: &[usize],
        explanation: &impl Fn(usize) -> &'e Explanation,
    ) -> Verdict {
        let is_explained = rivals.first().is_some_and(|&best| {
            let first = explanation(best);
            self.calm.explains(trial.misfit, first.score)
                || self
                    .calm
                    .explains(trial.misfit, first.score + self.second(best, first))
        });
        match rivals.len() {
            1 if is_explained => Verdict::Named,
            2.. if is_explained => Verdict::Ambiguous,
            _ if self.calm.is_exceeded_by(trial.misfit) => Verdict::Unknown,
            _ => Verdict::None,
        }
    }

    /// The best score of another effect in what the first one leaves, where it counts: two effects may be hidden.
    fn second(&self, best: usize, first: &Explanation) -> f64 {
        let (space, left) = match &first.refit {
            Some(refit) => (&refit.space, refit.left.clone()),
            None => (&self.space, &self.residual - &first.change),
        };
        self.effects
            .iter()
            .enumerate()
            .filter(|&(index, _)| index != best)
            .filter_map(|(index, (_, directions))| {
                let seen: Vec<_> = directions.iter().map(|d| d.seen_in(space)).collect();
                let score = scan(&seen, &left, space)?.score;
                (score > self.calm.thresholds[index]).then_some(score)
            })
            .fold(0.0, f64::max)
    }
}
