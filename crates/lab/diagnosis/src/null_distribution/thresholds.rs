//! Thresholds of scores that keep the family-wise error rate: P. Westfall and S. Young, "Resampling-Based Multiple Testing"
//! (1993), chapter 2, the distribution of the maximum over all effects.

use super::{CONFIDENCE, FLOOR};
use crate::quantile::{quantile, sorted};

/// A quantile of some hundreds of scores is known to a standard deviation or so: an amplitude, the root of a score, must
/// exceed it by the one-sided 95 % quantile of a normal distribution.
pub(crate) const MARGIN: f64 = 1.64;

/// A threshold for each effect, from its scores in all null mirrors (`scores[effect][mirror]`).
///
/// Effects differ in how like the discrepancy they are, so each has a scale of its own, the quantile of its scores. A common
/// factor on all scales, the quantile of the mirrors' largest scores in units of them, holds for whichever effect is best.
pub(super) fn of(scores: &[Vec<f64>]) -> Vec<f64> {
    let scales: Vec<f64> = scores
        .iter()
        .map(|scores| quantile(&sorted(scores.iter().copied()), CONFIDENCE).max(FLOOR))
        .collect();
    let mirrors = scores.first().map_or(0, Vec::len);
    let largest = sorted((0..mirrors).map(|mirror| {
        let relative = scores
            .iter()
            .zip(&scales)
            .map(|(scores, scale)| scores[mirror] / scale);
        relative.fold(0.0, f64::max)
    }));
    if largest.is_empty() {
        return Vec::new();
    }
    let factor = quantile(&largest, CONFIDENCE).max(1.0);
    let threshold = |scale: &f64| ((factor * scale).sqrt() + MARGIN).powi(2);
    scales.iter().map(threshold).collect()
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
        // 0, 10, ..., 1000: the 95 % quantile is 950.
        let scores: Vec<f64> = (0..=100).map(|n| 10.0 * f64::from(n)).collect();
        assert_close(&of(&[scores]), &[by_hand(950.0)]);
    }

    #[test]
    fn small_scores_leave_the_floor() {
        assert_close(&of(&[vec![0.0; 50], vec![3.0; 50]]), &[by_hand(FLOOR); 2]);
    }

    #[test]
    fn many_effects_are_judged_by_the_largest_of_all() {
        // Two effects, each with a score of 1000 in five mirrors of 101, and 100 in all others. The sixth largest of an effect's
        // scores, its 95 % quantile, is 100. Ten mirrors show one or the other, so the largest has a quantile of 1000.
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
        let thresholds = of(&[one_in_five(0), one_in_five(5)]);
        assert_close(&thresholds, &[by_hand(1000.0); 2]);
        // The same five mirrors for both: one test, not two.
        let thresholds = of(&[one_in_five(0), one_in_five(0)]);
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
        let thresholds = of(&scores());
        let fresh = scores();
        let wrong = (0..240)
            .filter(|&mirror| (0..20).any(|effect| fresh[effect][mirror] > thresholds[effect]))
            .count();
        // 5 % of 240 are 12, and no more than two standard deviations beyond that are 19.
        assert!(wrong <= 19, "{wrong} of 240");
    }
}
