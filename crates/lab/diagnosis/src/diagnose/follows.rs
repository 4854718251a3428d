//! Whether the model follows the readings at all.

use super::analysis::Analysis;
use crate::candidate::Candidate;

/// A model that leaves so many times what is left of 95 in 100 mirrors that lack nothing does not follow at all: a choice.
const FOLLOWS: f64 = 10.0;

impl Analysis<'_> {
    /// Whether the base without an effect follows the readings about as well as mirrors that lack nothing let it. Where it does not, its fit has
    /// stopped where its own slopes explain what is left, whatever that is.
    pub(super) fn follows(&self) -> bool {
        self.is_followed(self.error().value)
    }

    /// The same with an effect.
    pub(super) fn follows_with(&self, candidate: &Candidate) -> bool {
        let explanation = candidate.explanation.as_ref();
        explanation.is_some_and(|explanation| {
            let errors = self.before_and_after(candidate, explanation, self.unit());
            self.is_followed(errors.after)
        })
    }

    /// Whether the base leaves a larger error than it does of 95 in 100 mirrors that lack nothing.
    pub(super) fn errs_more_than_its_discrepancy(&self) -> bool {
        self.error().value > self.large_discrepancy().value
    }

    fn is_followed(&self, error: f64) -> bool {
        !self.data.has_displacement() || error <= FOLLOWS * self.large_discrepancy().value
    }
}
