//! Thresholds of scores that keep the family-wise error rate: P. Westfall and S. Young, "Resampling-Based Multiple Testing"
//! (1993), chapter 2, the distributions of the largest score and of the least p-value over all effects.

use super::rates::{CONFIDENCE, FLOOR, MARGIN};
use crate::quantile::sorted;

/// A threshold for each effect, from its scores in all null mirrors (`scores[effect][mirror]`), none of which count for less than
/// `least`.
///
/// Effects differ in how like the discrepancy they are. What is like that of no mirror needs no more than its own scores, what
/// is like that of many no more than the largest score of any effect. Each has the lower of the two limits, both so far up that
/// the mirrors which exceed either, with whichever effect, are no more than the family-wise error rate allows.
///
/// A score below which no threshold lies is no evidence against any: no mirror stands out by it.
pub(super) fn of(scores: &[Vec<f64>], least: f64) -> Vec<f64> {
    let least = least.max((FLOOR.sqrt() - MARGIN).powi(2));
    let counted = |of: &Vec<f64>| of.iter().map(|score| score.max(least)).collect();
    let counted: Vec<Vec<f64>> = scores.iter().map(counted).collect();
    let null = NullScores::of(&counted);
    let allowed = ((1.0 - CONFIDENCE) * null.mirrors() as f64) as usize;
    let keeps_the_rate = |limits: &Vec<f64>| null.exceeding(limits) <= allowed;
    let limits = (0..=allowed).rev().map(|count| null.limits(count));
    let limits = limits.into_iter().find(keeps_the_rate);
    let threshold = |limit: f64| (limit.max(least).sqrt() + MARGIN).powi(2);
    limits
        .unwrap_or(vec![least; scores.len()])
        .into_iter()
        .map(threshold)
        .collect()
}

/// The scores of the null mirrors, in order.
struct NullScores<'a> {
    scores: &'a [Vec<f64>],
    /// Each effect's.
    own: Vec<Vec<f64>>,
    /// The mirrors' largest.
    largest: Vec<f64>,
    /// By how many mirrors, itself included, that effect's score is reached with which a mirror stands out most.
    standing_out: Vec<usize>,
}

impl<'a> NullScores<'a> {
    fn of(scores: &'a [Vec<f64>]) -> Self {
        let mirrors = scores.first().map_or(0, Vec::len);
        let own: Vec<Vec<f64>> = scores
            .iter()
            .map(|scores| sorted(scores.iter().copied()))
            .collect();
        let largest = |mirror: usize| scores.iter().map(|of| of[mirror]).fold(0.0, f64::max);
        let reached = |mirror: usize| {
            let by = scores.iter().zip(&own).map(|(scores, own)| {
                let below = own.partition_point(|other| *other < scores[mirror]);
                mirrors - below
            });
            by.min().unwrap_or(mirrors)
        };
        let mut standing_out: Vec<usize> = (0..mirrors).map(reached).collect();
        standing_out.sort_unstable();
        Self {
            largest: sorted((0..mirrors).map(largest)),
            standing_out,
            own,
            scores,
        }
    }

    fn mirrors(&self) -> usize {
        self.largest.len()
    }

    /// The lower of two limits for each effect: its own and one for all, each of which no more mirrors than `count` exceed with
    /// whichever effect. None without mirrors.
    fn limits(&self, count: usize) -> Vec<f64> {
        let Some(&reached) = self.standing_out.get(count) else {
            return vec![0.0; self.own.len()];
        };
        let common = self.largest[self.mirrors() - 1 - count];
        let own = self.own.iter().map(|own| own[self.mirrors() - reached]);
        own.map(|own| own.min(common)).collect()
    }

    /// How many mirrors exceed one of these limits.
    fn exceeding(&self, limits: &[f64]) -> usize {
        let exceeds = |mirror: &usize| {
            let mut scores = self.scores.iter().zip(limits);
            scores.any(|(scores, limit)| scores[*mirror] > *limit)
        };
        (0..self.mirrors()).filter(exceeds).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_hand(score: f64) -> f64 {
        (score.sqrt() + MARGIN).powi(2)
    }

    fn assert_close(thresholds: &[f64], expected: &[f64]) {
        assert_eq!(thresholds.len(), expected.len());
        for (threshold, expected) in thresholds.iter().zip(expected) {
            assert!(
                (threshold - expected).abs() < 1e-9,
                "{threshold} {expected}"
            );
        }
    }

    #[test]
    fn one_effect_has_the_quantile_of_its_scores() {
        // 0, 10, ..., 1000: five of 101 score more than 950.
        let scores: Vec<f64> = (0..=100).map(|n| 10.0 * f64::from(n)).collect();
        assert_close(&of(&[scores], 0.0), &[by_hand(950.0)]);
    }

    #[test]
    fn small_scores_leave_the_floor() {
        let small = [vec![0.0; 50], vec![3.0; 50]];
        assert_close(&of(&small, 0.0), &[FLOOR; 2]);
        assert_close(&of(&small, FLOOR), &[by_hand(FLOOR); 2]);
        assert_close(&of(&[vec![]], 0.0), &[FLOOR]);
    }

    #[test]
    fn scores_below_every_threshold_raise_no_other() {
        // Five of a hundred mirrors show the first effect, as many as may. Twenty more show a trace of an effect each.
        let first: Vec<f64> = (0..100).map(|n| if n < 5 { 900.0 } else { 0.0 }).collect();
        let trace = |mirror: u8| -> Vec<f64> {
            (0..100)
                .map(|n| f64::from(5 * u8::from(n == mirror)))
                .collect()
        };
        let traces = (20..40).map(trace);
        let scores: Vec<Vec<f64>> = std::iter::once(first).chain(traces).collect();
        assert_close(&of(&scores, 0.0), &[FLOOR; 21]);
    }

    #[test]
    fn each_effect_is_judged_by_its_own_scores() {
        // One effect is like the discrepancy of every tenth mirror, the other of none: only the first needs more.
        let like: Vec<f64> = (0..100)
            .map(|n| f64::from(100 * u8::from(n % 10 == 0)))
            .collect();
        let thresholds = of(&[like, vec![0.0; 100]], 0.0);
        assert_close(&thresholds, &[by_hand(100.0), FLOOR]);
    }

    #[test]
    fn what_is_like_the_discrepancy_of_many_needs_no_more_than_the_largest_score() {
        // Of a hundred mirrors three show the first effect, by 900, and three others the second, by 30 to 32. Five may exceed
        // a limit. By their own scores alone the effects would need 900 and 31.
        let first: Vec<f64> = (0..100).map(|n| if n < 3 { 900.0 } else { 0.0 }).collect();
        let second = (0..100).map(|n| if n > 96 { f64::from(n - 67) } else { 0.0 });
        let thresholds = of(&[first, second.collect()], 0.0);
        assert_close(&thresholds, &[by_hand(30.0), by_hand(30.0)]);
    }

    #[test]
    fn many_effects_are_judged_at_a_higher_level() {
        // Two effects, each with a score of 1000 in five mirrors of 101, and 100 in all others. The sixth largest of an effect's
        // scores is 100. Ten mirrors show one or the other, more than the five that may exceed a limit.
        let one_in_five = |first: usize| -> Vec<f64> {
            (0..101)
                .map(|mirror| {
                    if (first..first + 5).contains(&mirror) {
                        1000.0
                    } else {
                        100.0
                    }
                })
                .collect()
        };
        let thresholds = of(&[one_in_five(0), one_in_five(5)], 0.0);
        assert_close(&thresholds, &[by_hand(1000.0); 2]);
        // The same five mirrors for both: one test, not two.
        let thresholds = of(&[one_in_five(0), one_in_five(0)], 0.0);
        assert_close(&thresholds, &[by_hand(100.0); 2]);
    }

    #[test]
    fn the_family_wise_error_rate_is_kept() {
        // 20 effects, independent scores: without the common factor 64 % of the mirrors would exceed one of the scales.
        use rand::{Rng, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut scores = || -> Vec<Vec<f64>> {
            (0..20)
                .map(|_| {
                    (0..240)
                        .map(|_| 1000.0 * rng.random::<f64>().powi(2))
                        .collect()
                })
                .collect()
        };
        let thresholds = of(&scores(), 0.0);
        let fresh = scores();
        let wrong = (0..240)
            .filter(|&mirror| (0..20).any(|effect| fresh[effect][mirror] > thresholds[effect]))
            .count();
        // 5 % of 240 are 12, and no more than two standard deviations beyond that are 19.
        assert!(wrong <= 19, "{wrong} of 240");
    }
}
