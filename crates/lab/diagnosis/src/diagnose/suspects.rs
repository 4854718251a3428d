//! Which effects may be missing: those above their thresholds that have something to name, and the rivals of the best of them.

use super::analysis::Analysis;
use crate::candidate::Candidate;
use crate::confusions::{RIVAL_SHARE, confusions};

/// Candidates this close to the best score are rivals however small both are: two parameters' price.
const RIVAL_MARGIN: f64 = 12.0;
/// A sum of squares is far smaller below this part of another: errors of three quarters.
pub(super) const FAR_SMALLER: f64 = 0.5;

/// The effects that may be missing.
pub(super) struct Suspects<'c> {
    /// The best of those above their thresholds, and those that come near it.
    pub(super) rivals: Vec<&'c Candidate>,
    /// The rivals, and all others above their thresholds.
    pub(super) evident: Vec<&'c Candidate>,
}

impl Analysis<'_> {
    /// Those of these candidates, the best first.
    pub(super) fn suspects<'c>(&self, candidates: &'c [Candidate]) -> Suspects<'c> {
        type Two<'c> = (Vec<&'c Candidate>, Vec<&'c Candidate>);
        let (effective, idle): Two = candidates
            .iter()
            .partition(|candidate| self.has_an_effect(candidate));
        let (plausible, at_an_end): Two = effective
            .into_iter()
            .partition(|candidate| candidate.is_plausible());
        let (with_effect, refused): Two = plausible
            .into_iter()
            .partition(|candidate| self.is_shown_on_others(candidate));
        let share = |candidate: &str, best: &str| {
            confusions().rival_share(self.channels(), candidate, best)
        };
        let rivals = rivals(&with_effect, share, |candidate| {
            let refit = candidate.refit.as_ref()?;
            Some(refit.fitted.cost(self.data))
        });
        // Beside one that scores more and lowers no error on rows held out, what the best of the rivals scores is no more than chance; beside one
        // that lowers none at all, where mirrors that lack nothing leave as much.
        let mut chance = refused;
        if !self.null.is_exceeded_by(self.misfit) {
            chance.extend(idle);
        }
        let rivals = unless_below(rivals, &chance, |most| most);
        // What is no rival of one that would have to be greater than any mirror has, is not named beside it.
        let rivals = unless_below(rivals, &at_an_end, least_of_a_rival);
        let is_evident = |c: &&Candidate| {
            let is_rival = rivals.iter().any(|r| r.id() == c.id());
            is_rival || !rivals.is_empty() && c.is_above_its_threshold()
        };
        Suspects {
            evident: with_effect.into_iter().filter(is_evident).collect(),
            rivals,
        }
    }
}

/// The least score of a rival of what scores so much.
fn least_of_a_rival(top: f64) -> f64 {
    least_of(RIVAL_SHARE, top)
}

/// The least score beside a top one of which it must be a share, or near it.
pub(super) fn least_of(share: f64, top: f64) -> f64 {
    (share * top).min(top - RIVAL_MARGIN)
}

/// What these are called.
pub(super) fn ids(candidates: &[&Candidate]) -> Vec<String> {
    candidates.iter().map(|c| c.id().to_owned()).collect()
}

/// The best of the candidates above their thresholds, and those that come near it. `share` says which part of the best one's score
/// makes a candidate a rival, above its own threshold or not: once it is evident that something is missing, the scores alone say
/// what. One with which `left`, the sum of squares after a fit together with the base, is far smaller is a rival whatever its
/// score, if it is above: what the discrepancy could explain as well may be the effect. One that comes near the best and leaves far more
/// than another that does is none: a discrepancy of one kind, however large, costs a score little.
fn rivals<'c>(
    candidates: &[&'c Candidate],
    share: impl Fn(&str, &str) -> f64,
    left: impl Fn(&Candidate) -> Option<f64>,
) -> Vec<&'c Candidate> {
    let mut above = candidates.iter().filter(|c| c.is_above_its_threshold());
    let Some(best) = above.next() else {
        return Vec::new();
    };
    let top = best.score();
    let leaves_far_less = |one: &Candidate, other: &Candidate| {
        let both = left(one).zip(left(other));
        both.is_some_and(|(one, other)| one < FAR_SMALLER * other)
    };
    let is_near = |c: &&Candidate| c.score() > least_of(share(c.id(), best.id()), top);
    let near: Vec<_> = candidates.iter().copied().filter(is_near).collect();
    let is_left_behind = |candidate: &Candidate| near.iter().any(|c| leaves_far_less(c, candidate));
    let is_rival = |candidate: &&Candidate| {
        if is_near(candidate) {
            return !is_left_behind(candidate);
        }
        candidate.is_above_its_threshold() && leaves_far_less(candidate, best)
    };
    candidates.iter().copied().filter(is_rival).collect()
}

/// The rivals, or none where the best of them scores less than the `least` beside the best of others that are above their thresholds and may
/// not be named.
fn unless_below<'c>(
    rivals: Vec<&'c Candidate>,
    others: &[&Candidate],
    least: impl Fn(f64) -> f64,
) -> Vec<&'c Candidate> {
    let above = others.iter().filter(|c| c.score() > c.threshold);
    let most = above.map(|c| c.score()).fold(0.0, f64::max);
    match rivals.first() {
        Some(best) if best.score() >= least(most) => rivals,
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::scored;

    #[test]
    fn rivals_come_near_the_best_score() {
        let candidates = [
            scored("creep", 1000.0),
            scored("hysteresis", 930.0),
            scored("resonance", 910.0),
            scored("sensor-lag", 700.0),
        ];
        let all: Vec<_> = candidates.iter().collect();
        assert_eq!(
            ids(&rivals(&all, |_, _| 0.92, |_| None)),
            ["creep", "hysteresis"]
        );
        // What was taken for the best one is its rival from further off.
        let learned = |candidate: &str, best: &str| {
            assert_eq!(best, "creep");
            if candidate == "sensor-lag" { 0.6 } else { 0.92 }
        };
        let found = rivals(&all, learned, |_| None);
        assert_eq!(ids(&found), ["creep", "hysteresis", "sensor-lag"]);
        assert!(rivals(&[], |_, _| 0.92, |_| None).is_empty());
    }

    #[test]
    fn what_was_refused_leaves_its_name_to_nobody_below() {
        let refused = [scored("quadratic-tcr", 64.0)];
        let refused: Vec<_> = refused.iter().collect();
        let below = [scored("film-tcr", 38.0)];
        let above = [scored("creep", 70.0)];
        assert!(unless_below(below.iter().collect(), &refused, |most| most).is_empty());
        assert_eq!(
            ids(&unless_below(above.iter().collect(), &refused, |most| most)),
            ["creep"]
        );
        assert_eq!(
            ids(&unless_below(below.iter().collect(), &[], |most| most)),
            ["film-tcr"]
        );
    }

    #[test]
    fn what_explains_more_at_an_end_of_its_range_leaves_its_name_to_nobody_below() {
        let most = [scored("heat-loss-temperature", 1000.0)];
        let most: Vec<_> = most.iter().collect();
        let [far_below, near] = [scored("end-stop", 560.0), scored("radiation", 930.0)];
        assert!(unless_below(vec![&far_below], &most, least_of_a_rival).is_empty());
        assert_eq!(
            ids(&unless_below(vec![&near], &most, least_of_a_rival)),
            ["radiation"]
        );
        assert_eq!(
            ids(&unless_below(vec![&far_below], &[], least_of_a_rival)),
            ["end-stop"]
        );
    }

    #[test]
    fn who_leaves_far_less_is_a_rival_whatever_the_score() {
        let candidates = [
            scored("heat-loss-temperature", 1000.0),
            scored("radiation", 500.0),
        ];
        let all: Vec<_> = candidates.iter().collect();
        let left = |radiation: f64| {
            move |candidate: &Candidate| match candidate.id() {
                "radiation" => Some(radiation),
                _ => Some(100.0),
            }
        };
        let count = |radiation| rivals(&all, |_, _| 0.92, left(radiation)).len();
        assert_eq!([count(40.0), count(60.0)], [2, 1]);
    }

    #[test]
    fn who_leaves_far_more_than_another_that_comes_as_near_is_no_rival() {
        let candidates = [
            scored("thermal-lag", 1000.0),
            scored("substrate-warming", 990.0),
            scored("creep", 980.0),
        ];
        let all: Vec<_> = candidates.iter().collect();
        let left = |candidate: &Candidate| match candidate.id() {
            "thermal-lag" => Some(100.0),
            "substrate-warming" => Some(40.0),
            // Not fitted together with the base: nobody knows.
            _ => None,
        };
        let found = rivals(&all, |_, _| 0.92, left);
        assert_eq!(ids(&found), ["substrate-warming", "creep"]);
    }

    #[test]
    fn what_comes_near_is_a_rival_below_its_threshold_too() {
        // 25 is the threshold of both; of what is below it nobody is the first.
        let needing_25 = |id, score| Candidate {
            threshold: 25.0,
            ..scored(id, score)
        };
        let candidates = [
            needing_25("gap-heat-loss", 27.0),
            needing_25("radiation", 24.0),
        ];
        let all: Vec<_> = candidates.iter().collect();
        assert_eq!(ids(&rivals(&all, |_, _| 0.92, |_| None)).len(), 2);
        assert!(rivals(&all[1..], |_, _| 0.92, |_| None).is_empty());
    }

    #[test]
    fn small_scores_are_rivals_within_a_margin() {
        // 92 % of 50 is 46, and 12 below it is 38.
        let candidates = [
            scored("creep", 50.0),
            scored("hysteresis", 39.0),
            scored("resonance", 37.0),
        ];
        let all: Vec<_> = candidates.iter().collect();
        assert_eq!(
            ids(&rivals(&all, |_, _| 0.92, |_| None)),
            ["creep", "hysteresis"]
        );
    }
}
