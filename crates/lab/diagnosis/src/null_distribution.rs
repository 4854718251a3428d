//! The null distribution of misfits and scores, from mirrors that lack nothing: what may be called missing, and what not.
//!
//! A user's mirror comes from a family that nobody has seen. So each family of the null ensemble is held against the
//! discrepancy that the other families span: leave-one-family-out cross-validation.

mod left_out;
mod rates;
mod thresholds;

pub(crate) use left_out::LeftOutFamily;
pub(crate) use rates::{CONFIDENCE, FLOOR, MARGIN};

use crate::candidate::Candidate;
use crate::quantile::{quantile, sorted};

/// What an effect leaves, beyond what its form may, must be no more than what this share of the null mirrors leave: the space
/// that weighs them knows a family less than the session's. Set by `cargo xtask bench diagnose`.
const ORDINARY: f64 = 0.9;
/// An effect that is named may leave, beyond what null mirrors leave, this share of what it explains: nature's form is not
/// quite the candidate's. Set by `cargo xtask bench diagnose`.
const FORM: f64 = 0.3;

/// What mirrors that lack nothing, each of a family that was left out, show.
pub(crate) struct NullDistribution {
    /// Their misfits, in order.
    misfits: Vec<f64>,
    /// What each score counts for at least.
    least: f64,
}

impl NullDistribution {
    /// That of these families, and each candidate's threshold from it. Where they are `cramped`, by so few readings that virtual
    /// mirrors have no room to show anything, or by standing for something else, their scores count for [`FLOOR`] at least.
    pub(crate) fn new(
        families: &[LeftOutFamily],
        cramped: bool,
        candidates: &mut [Candidate],
    ) -> Self {
        let misfits: Vec<f64> = families.iter().flat_map(LeftOutFamily::misfits).collect();
        let least = if cramped { FLOOR } else { 0.0 };
        let null = Self {
            least,
            ..Self::of(&misfits)
        };
        let scores: Vec<Vec<f64>> = parallel::map(candidates.iter(), |candidate| {
            let scores = families.iter().flat_map(|family| family.scores(candidate));
            let pairs = scores.zip(&misfits);
            pairs
                .map(|(score, &misfit)| null.believed(score, misfit))
                .collect()
        });
        let thresholds = null.thresholds(&scores).into_iter().zip(scores);
        for (candidate, (threshold, null_scores)) in candidates.iter_mut().zip(thresholds) {
            candidate.threshold = threshold;
            candidate.null_scores = null_scores;
        }
        null
    }

    fn of(misfits: &[f64]) -> Self {
        Self {
            misfits: sorted(misfits.iter().copied()),
            least: 0.0,
        }
    }

    /// A threshold for each kind of score, of which each mirror has one (`scores[kind][mirror]`), such that in 95 of 100 no score
    /// of any kind is above.
    pub(crate) fn thresholds(&self, scores: &[Vec<f64>]) -> Vec<f64> {
        thresholds::of(scores, self.least)
    }

    /// The median misfit.
    pub(crate) fn median(&self) -> f64 {
        quantile(&self.misfits, 0.5)
    }

    /// Whether a misfit is more than mirrors that lack nothing show, and more than a few readings could.
    pub(crate) fn is_exceeded_by(&self, misfit: f64) -> bool {
        misfit > quantile(&self.misfits, CONFIDENCE).max(self.median() + FLOOR)
    }

    /// Whether effects that lower a misfit by `score` leave no more than what mirrors that lack nothing leave, and what the
    /// effects' forms may be off by.
    pub(crate) fn explains(&self, misfit: f64, score: f64) -> bool {
        self.is_ordinary(unexplained(misfit, score))
    }

    /// Whether a misfit is no more than what most mirrors that lack nothing show.
    pub(crate) fn is_ordinary(&self, misfit: f64) -> bool {
        misfit <= quantile(&self.misfits, ORDINARY)
    }

    /// A score that counts: none, where so much is left that the effect would not be named.
    fn believed(&self, score: f64, misfit: f64) -> f64 {
        if self.is_exceeded_by(unexplained(misfit, score)) {
            0.0
        } else {
            score
        }
    }
}

/// What is left of a misfit that effects lower by `score`, and that their forms may not be to blame for.
fn unexplained(misfit: f64, score: f64) -> f64 {
    misfit - (1.0 + FORM) * score
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Misfits 1 to 101: the median is 51, the 90 % quantile 91, the 95 % quantile 96.
    fn null() -> NullDistribution {
        NullDistribution::of(&(1..=101).rev().map(f64::from).collect::<Vec<_>>())
    }

    #[test]
    fn a_misfit_exceeds_what_95_of_100_show() {
        let null = null();
        assert_eq!(null.median(), 51.0);
        assert!(!null.is_exceeded_by(96.0) && null.is_exceeded_by(96.1));
        // Where all null misfits are alike, it must exceed them by five standard deviations.
        let alike = NullDistribution::of(&[10.0; 20]);
        assert!(!alike.is_exceeded_by(35.0) && alike.is_exceeded_by(35.1));
    }

    #[test]
    fn an_effect_explains_a_misfit_up_to_what_its_form_may_leave() {
        let null = null();
        // 221 - 1.3 * 100 = 91, the 90 % quantile.
        assert!(null.explains(221.0, 100.0));
        assert!(!null.explains(221.5, 100.0));
        assert!(null.explains(91.0, 0.0));
        // Its form aside, it leaves 121.
        assert!(null.is_ordinary(91.0) && !null.is_ordinary(221.0 - 100.0));
    }

    #[test]
    fn a_score_counts_where_little_is_left() {
        let null = null();
        // 226 - 130 = 96 is the 95 % quantile.
        assert_eq!(null.believed(100.0, 226.0), 100.0);
        assert_eq!(null.believed(100.0, 226.5), 0.0);
    }
}
