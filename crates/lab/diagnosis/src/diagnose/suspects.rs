//! Which effects may be missing: those above their thresholds that have something to name, and the rivals of the best of them.

use super::analysis::Analysis;
use crate::candidate::Candidate;
use crate::confusions::RIVAL_SHARE;

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
        let rivals = self.rivals(&with_effect);
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
}
