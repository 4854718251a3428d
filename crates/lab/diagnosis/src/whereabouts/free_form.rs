//! A free-form function in the space of residuals: a generalised additive model's one smooth term, fitted by ridge regression.

use crate::candidate::PRICE;
use crate::residual_space::{Kind, Vector};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Prior standard deviations of a function's values that are tried, in parts of a probe's amplitude (1 % of the quantity's
/// range): from nothing to all of the range, half a decade apart.
const SPREADS: [f64; 10] = [1e-3, 3.2e-3, 1e-2, 3.2e-2, 0.1, 0.32, 1.0, 3.2, 10.0, 100.0];

/// The normal equations of some directions' amplitudes: the directions' products with each other, and with a residual.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub(crate) gram: DMatrix<f64>,
    pub(crate) onto: DVector<f64>,
}

impl Normal {
    /// Of these directions and this residual.
    pub(crate) fn of<K: Kind>(directions: &[Vector<K>], residual: &Vector<K>) -> Self {
        Self::onto(&gram(directions), directions, residual)
    }

    /// The same where the directions' products with each other are known.
    pub(crate) fn onto<K: Kind>(
        gram: &DMatrix<f64>,
        directions: &[Vector<K>],
        residual: &Vector<K>,
    ) -> Self {
        let onto = directions.iter().map(|direction| direction.dot(residual));
        Self {
            gram: gram.clone(),
            onto: DVector::from_iterator(directions.len(), onto),
        }
    }

    /// The score of the function that fits best: the fall of the misfit less the price of its effective degrees of freedom
    /// (T. Hastie and R. Tibshirani, "Generalized Additive Models" (1990), section 3.5), under the prior that is worth most.
    pub(crate) fn score(&self) -> f64 {
        let eigen = SymmetricEigen::new(self.gram.clone());
        let along = eigen.eigenvectors.tr_mul(&self.onto);
        let score = |spread: f64| {
            let ridge = spread.powi(-2);
            let parts = eigen.eigenvalues.iter().zip(along.iter());
            parts.fold(0.0, |sum, (weight, along)| {
                let weight = weight.max(0.0);
                let drop = along * along * (weight + 2.0 * ridge) / (weight + ridge).powi(2);
                sum + drop - PRICE * weight / (weight + ridge)
            })
        };
        SPREADS.into_iter().map(score).fold(0.0, f64::max)
    }

    /// The size of amplitudes in these proportions that explains most.
    pub(crate) fn amplitude_along(&self, proportions: &DVector<f64>) -> f64 {
        let weight = (&self.gram * proportions).dot(proportions);
        self.onto.dot(proportions) / weight.max(f64::MIN_POSITIVE)
    }

    /// The fall of the misfit with amplitudes in these proportions, whatever their size.
    pub(crate) fn drop_along(&self, proportions: &DVector<f64>) -> f64 {
        let weight = (&self.gram * proportions).dot(proportions);
        let along = self.onto.dot(proportions);
        if weight > 0.0 {
            along * along / weight
        } else {
            0.0
        }
    }
}

/// The products of directions with each other.
pub(crate) fn gram<K: Kind>(directions: &[Vector<K>]) -> DMatrix<f64> {
    let count = directions.len();
    DMatrix::from_fn(count, count, |i, j| directions[i].dot(&directions[j]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(weights: &[f64], along: &[f64]) -> Normal {
        Normal {
            gram: DMatrix::from_diagonal(&DVector::from_row_slice(weights)),
            onto: DVector::from_row_slice(along),
        }
    }

    #[test]
    fn a_clear_function_costs_its_parameters_and_an_absent_one_nothing() {
        // Two orthogonal directions of weight 1e6 that explain 1e6 each: drop 2e6, two degrees of freedom.
        let clear = normal(&[1e6, 1e6], &[1e6, 1e6]).score();
        assert!((clear - (2e6 - 2.0 * PRICE)).abs() < 1.0, "{clear}");
        assert_eq!(normal(&[1e6, 1e6], &[0.0, 0.0]).score(), 0.0);
    }

    #[test]
    fn a_direction_that_explains_nothing_is_not_paid_for_in_full() {
        let one = normal(&[1e4], &[1e3]).score();
        let with_a_weak_one = normal(&[1e4, 1e-2], &[1e3, 0.0]).score();
        // Not paid for in full: 6 for each degree of freedom, of which it has next to none.
        assert!(
            (one - with_a_weak_one).abs() < 0.5,
            "{one} {with_a_weak_one}"
        );
    }

    #[test]
    fn along_the_best_proportions_the_misfit_falls_by_all_that_is_explained() {
        let normal = normal(&[4.0, 1.0], &[8.0, 3.0]);
        // Amplitudes 2 and 3: 8 * 2 + 3 * 3.
        let best = DVector::from_row_slice(&[2.0, 3.0]);
        assert!((normal.drop_along(&best) - 25.0).abs() < 1e-12);
        let other = DVector::from_row_slice(&[1.0, 0.0]);
        assert_eq!(normal.drop_along(&other), 16.0);
    }
}
