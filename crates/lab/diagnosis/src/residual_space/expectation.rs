//! What of a mirror's discrepancy follows from the base's parameters as fitted to it: a mirror that is slow, or loses more heat,
//! leaves residuals of another shape. The ensemble's residuals are regressed on its coordinates, which leaves the discrepancy
//! conditional on them [M. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425-464, section 4].
//!
//! The regression is linear, row by row, and its coefficients are sums of the members' residuals, so that all of it is algebra
//! of members.

use super::reach::reach;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The precision of the prior of each slope, about zero: that of one member whose coordinate is one standard deviation off the
/// mean (the unit information prior of R. Kass and L. Wasserman, J. Am. Stat. Assoc. 90 (1995) 928-934). What the members'
/// coordinates do not tell, as how four actuators differ that are made alike, is not extrapolated.
const UNIT: f64 = 1.0;

/// A linear regression of members' residuals on their coordinates.
#[derive(Debug)]
pub(super) struct Expectation {
    /// Of the ensemble.
    members: usize,
    /// Those that it is learned from.
    learned: Vec<usize>,
    coordinates: Vec<Coordinate>,
    /// The features of the members that it is learned from, a column each, and the same times their weights.
    features: DMatrix<f64>,
    weighted: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

/// Where the members lie along one coordinate.
#[derive(Debug)]
struct Coordinate {
    mean: f64,
    deviation: f64,
    low: f64,
    high: f64,
}

impl Coordinate {
    fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Self {
            mean,
            deviation: (square / count).sqrt(),
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// In standard deviations from the mean, no further than the members lie; 0 where they do not differ.
    fn standardised(&self, value: f64) -> f64 {
        if self.deviation > 0.0 {
            (value.clamp(self.low, self.high) - self.mean) / self.deviation
        } else {
            0.0
        }
    }
}

impl Expectation {
    /// Learned from some members of an ensemble with these coordinates, a member a column, and these products of the residuals
    /// with each other. Members that are fitted badly count less.
    pub(super) fn new(coordinates: &DMatrix<f64>, gram: &DMatrix<f64>, learned: &[usize]) -> Self {
        let along = |row: usize| -> Vec<f64> {
            learned
                .iter()
                .map(|&member| coordinates[(row, member)])
                .collect()
        };
        let along = (0..coordinates.nrows()).map(|row| Coordinate::of(&along(row)));
        let mut expectation = Self {
            members: gram.ncols(),
            learned: learned.to_vec(),
            coordinates: along.collect(),
            features: DMatrix::zeros(0, learned.len()),
            weighted: DMatrix::zeros(0, learned.len()),
            normal: Cholesky::new(DMatrix::identity(0, 0)).expect("an empty matrix has a factor"),
        };
        if expectation.coordinates.is_empty() {
            return expectation;
        }
        let features: Vec<_> = learned
            .iter()
            .map(|&member| expectation.features(coordinates.column(member).as_slice()))
            .collect();
        let features = DMatrix::from_columns(&features);
        let own = gram.select_rows(learned).select_columns(learned);
        let mut weighted = features.clone();
        for (mut column, reach) in weighted.column_iter_mut().zip(reach(&own)) {
            column *= reach * reach;
        }
        let prior = DMatrix::identity(features.nrows(), features.nrows()) * UNIT;
        expectation.normal = (&weighted * features.transpose() + prior)
            .cholesky()
            .expect("squares with a prior are positive definite");
        expectation.features = features;
        expectation.weighted = weighted;
        expectation
    }

    /// 1, and the coordinates.
    fn features(&self, coordinates: &[f64]) -> DVector<f64> {
        let along = self.coordinates.iter().zip(coordinates);
        let standardised = along.map(|(along, &value)| along.standardised(value));
        DVector::from_iterator(
            1 + self.coordinates.len(),
            std::iter::once(1.0).chain(standardised),
        )
    }

    /// The residual that is expected of a mirror with these coordinates: coefficients of the members.
    pub(super) fn expected(&self, coordinates: &[f64]) -> DVector<f64> {
        let mut coefficients = DVector::zeros(self.members);
        if self.coordinates.is_empty() {
            return coefficients;
        }
        let slopes = self.normal.solve(&self.features(coordinates));
        let shares = self.weighted.tr_mul(&slopes);
        for (&member, share) in self.learned.iter().zip(shares.iter()) {
            coefficients[member] = *share;
        }
        coefficients
    }

    /// What each of its members leaves of what the others let expect (PRESS residuals: D. Allen, Technometrics 16 (1974)
    /// 125-127): coefficients of the members, a column each.
    pub(super) fn unexpected(&self) -> DMatrix<f64> {
        let count = self.learned.len();
        let mut left = DMatrix::identity(count, count);
        if !self.coordinates.is_empty() {
            let shares = self.weighted.tr_mul(&self.normal.solve(&self.features));
            left -= &shares;
            for (index, mut column) in left.column_iter_mut().enumerate() {
                column /= 1.0 - shares[(index, index)];
            }
        }
        let mut coefficients = DMatrix::zeros(self.members, count);
        for (row, &member) in self.learned.iter().enumerate() {
            coefficients.row_mut(member).copy_from(&left.row(row));
        }
        coefficients
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thirty members of one coordinate, each a direction of its own.
    fn coordinates() -> DMatrix<f64> {
        DMatrix::from_fn(1, 30, |_, member| f64::from(member as u32 % 7))
    }

    /// What a residual of `of(coordinate)` along one row is expected to be.
    fn expected(of: fn(f64) -> f64, at: f64) -> f64 {
        let coordinates = coordinates();
        let residuals = coordinates.map(of);
        let gram = residuals.tr_mul(&residuals);
        let all: Vec<usize> = (0..30).collect();
        let learned = Expectation::new(&coordinates, &gram, &all);
        (residuals * learned.expected(&[at]))[(0, 0)]
    }

    #[test]
    fn a_straight_line_is_expected_but_for_the_prior_and_not_beyond_the_members() {
        let line = |x| 100.0 + x;
        for at in [0.0, 2.5, 6.0] {
            // The prior counts as one of 31 members, at 0.
            let off = expected(line, at) - line(at) * 30.0 / 31.0;
            assert!(off.abs() < 0.1, "{off} at {at}");
        }
        assert_eq!(expected(line, 1e3), expected(line, 6.0));
        assert_eq!(expected(line, f64::NEG_INFINITY), expected(line, 0.0));
    }

    #[test]
    fn what_a_member_leaves_is_told_without_it() {
        // By hand: the regression learned from all others, with the scales of all.
        let coordinates = coordinates();
        let residuals = DMatrix::from_fn(2, 30, |row, member| {
            let x = coordinates[(0, member)];
            if row == 0 { 5.0 + x } else { x.sin() }
        });
        let gram = residuals.tr_mul(&residuals);
        let all: Vec<usize> = (0..30).collect();
        let learned = Expectation::new(&coordinates, &gram, &all);
        let left = &residuals * learned.unexpected();
        let mut normal = DMatrix::identity(2, 2) * UNIT;
        let mut right = DMatrix::zeros(2, 2);
        for member in (0..30).filter(|&member| member != 4) {
            let features = learned.features.column(member);
            normal += learned.weighted.column(member) * features.transpose();
            right += learned.weighted.column(member) * residuals.column(member).transpose();
        }
        let slopes = normal.try_inverse().unwrap() * right;
        let by_hand = residuals.column(4) - slopes.tr_mul(&learned.features.column(4));
        assert!((left.column(4) - by_hand).norm() < 1e-9);
    }

    #[test]
    fn without_coordinates_nothing_is_expected() {
        let gram = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 4.0, 9.0]));
        let learned = Expectation::new(&DMatrix::zeros(0, 3), &gram, &[0, 2]);
        assert_eq!(learned.expected(&[]), DVector::zeros(3));
        let left = learned.unexpected();
        assert_eq!(left.as_slice(), [1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    }
}
