//! What is told beside a verdict, in sentences.

use super::analysis::Analysis;
use super::suspects::{Suspects, ids, least_of};
use crate::candidate::Candidate;
use crate::confusions::RIVAL_SHARE;
use crate::report::{BeforeAfter, Ranked, Remainder, Verdict, WORTHWHILE};
use crate::whereabouts::Located;
use identification::{jumps, unlike_actuator, unlike_heaters, wild_readings};

/// So many effects are told that take more of the error than the one that is named: those that a person would try first.
const TOLD: usize = 3;

impl Analysis<'_> {
    /// What was done to the readings, which of them may be of other heaters or wild, which actuator is unlike the others, and where nothing
    /// explains the readings, which of them a meter may have spoilt.
    pub(super) fn notes(&self, verdict: Verdict) -> Vec<String> {
        let mut notes = unlike_heaters(self.data, &self.base);
        notes.extend(unlike_actuator(self.data, &self.base));
        notes.extend(wild_readings(self.data, &self.base));
        if verdict == Verdict::Unknown {
            notes.extend(jumps(self.data, &self.base));
        }
        if !self.follows() {
            let large = self.large_discrepancy();
            notes.push(format!(
                "the model follows these readings nowhere near as well as mirrors that lack nothing, of which 95 in 100 leave {:.3} {} rms at most",
                large.value, large.unit
            ));
        }
        notes.extend(self.data.notes.iter().cloned());
        notes
    }

    /// Why nothing is named though one of these scores more than mirrors that lack nothing.
    pub(super) fn why_not_named(
        &self,
        suspects: &Suspects,
        candidates: &[Candidate],
    ) -> Option<String> {
        let best = candidates.iter().find(|c| c.score() > c.threshold)?;
        let is_suspect = suspects.rivals.iter().any(|rival| rival.id() == best.id());
        let reason = if !self.has_an_effect(best) {
            "with it the error does not fall"
        } else if !best.is_plausible() {
            "it would have to be greater than any mirror has"
        } else if !self.is_shown_on_others(best) {
            "with it the error does not fall on readings held out"
        } else if is_suspect {
            "it explains too little of what is left"
        } else {
            "what is above it is not named either"
        };
        Some(format!(
            "{} scores more than its threshold and is not named: {reason}",
            best.id()
        ))
    }
}

/// Why an effect is not named, beside the place where a function of any form explains more.
pub(super) fn refusal(effect: &Candidate, better: &Located) -> String {
    let percent = 100.0 * effect.score() / better.score;
    format!(
        "{} comes nearest and is not named: it explains {percent:.0} % of what a function of any form explains where {}",
        effect.id(),
        better.place
    )
}

/// Those of these effects, above their thresholds, that score about as much as what is named and are not named.
fn as_much<'c>(
    named: &[&Candidate],
    effects: &[&'c Candidate],
) -> impl Iterator<Item = &'c Candidate> {
    let least = named
        .first()
        .map(|best| least_of(RIVAL_SHARE, best.score()));
    let is_as_much = move |c: &&Candidate| {
        let is_named = named.iter().any(|named| named.id() == c.id());
        least.is_some_and(|least| c.score() > c.threshold.max(least)) && !is_named
    };
    effects.iter().copied().filter(is_as_much)
}

/// Which of these effects explain about as much as what is named, at an end of their ranges.
pub(super) fn beyond_any_mirror(named: &[&Candidate], effective: &[&Candidate]) -> Option<String> {
    let as_much = as_much(named, effective);
    let beyond: Vec<&Candidate> = as_much.filter(|c| !c.is_plausible()).collect();
    (!beyond.is_empty()).then(|| {
        format!(
            "{}: explains about as much, and would have to be greater than any mirror has",
            ids(&beyond).join(", ")
        )
    })
}

/// Which of these effects, which are evident, score about as much as what is named and are not named, since more is left with them.
pub(super) fn leave_more(
    named: &[&Candidate],
    evident: &[&Candidate],
    ranking: &[Ranked],
) -> Option<String> {
    let of = |c: &Candidate| ranking.iter().find(|ranked| ranked.effect == c.id());
    let told: Vec<String> = as_much(named, evident).filter_map(of).map(after).collect();
    (!told.is_empty()).then(|| {
        format!(
            "{}: scores about as much as what is named, and is not, since it leaves far more",
            told.join(", ")
        )
    })
}

/// An effect, and what is left with it.
fn after(ranked: &Ranked) -> String {
    let BeforeAfter { after, unit, .. } = ranked.error_rms;
    format!("{} (to {after:.3} {unit})", ranked.effect)
}

/// Which other effects leave clearly less than what the one that is named for its score leaves: a score counts what the discrepancy cannot
/// hold, be it small.
pub(super) fn take_more(left: &Remainder, ranking: &[Ranked]) -> Option<String> {
    let much = |ranked: &&Ranked| ranked.error_rms.after < (1.0 - WORTHWHILE) * left.rms.value;
    let mut others: Vec<&Ranked> = ranking
        .iter()
        .filter(|r| r.is_above())
        .filter(much)
        .collect();
    others.sort_by(|a, b| a.error_rms.after.total_cmp(&b.error_rms.after));
    let told: Vec<String> = others.into_iter().take(TOLD).map(after).collect();
    (!told.is_empty()).then(|| {
        format!(
            "other effects take more of the error, and one of them may be missing besides: {}",
            told.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::scored;
    use crate::words::tests::ranked;

    #[test]
    fn what_scores_as_much_and_leaves_far_more_is_told_with_what_it_leaves() {
        let all = ["creep", "thermal-lag", "hysteresis"].map(|id| {
            let mut ranked = ranked(id, 1000.0);
            ranked.error_rms.after = 0.386;
            ranked
        });
        let [creep, lag, other] = [
            scored("creep", 1000.0),
            scored("thermal-lag", 1001.0),
            scored("hysteresis", 300.0),
        ];
        let said = leave_more(&[&creep], &[&lag, &creep, &other], &all);
        assert_eq!(
            said.as_deref(),
            Some(
                "thermal-lag (to 0.386 mA): scores about as much as what is named, and is not, since it leaves far more"
            )
        );
        assert_eq!(leave_more(&[&creep], &[&creep, &other], &all), None);
        assert_eq!(leave_more(&[], &[&lag], &all), None);
    }

    #[test]
    fn what_explains_as_much_and_is_beyond_any_mirror_is_told() {
        let at_its_end = |score| {
            let mut candidate = scored("radiation", score);
            let explanation = candidate.explanation.as_mut().expect("a score");
            explanation.active.values[0] = 1e-13;
            candidate
        };
        let [named, beyond] = [scored("heat-loss-temperature", 390.0), at_its_end(400.0)];
        let said = beyond_any_mirror(&[&named], &[&named, &beyond]);
        assert!(said.is_some_and(|said| said.starts_with("radiation: explains")));
        assert_eq!(beyond_any_mirror(&[&named], &[&at_its_end(200.0)]), None);
        assert_eq!(beyond_any_mirror(&[&beyond], &[&beyond]), None);
        assert_eq!(beyond_any_mirror(&[], &[&beyond]), None);
    }
}
