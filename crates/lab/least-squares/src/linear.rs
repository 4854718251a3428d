//! Linear least squares within bounds, by an active set.

use crate::Bounds;
use nalgebra::{Cholesky, DMatrix, DVector};

/// A multiplier below this share of the largest that a column and a right side of such a size can have is rounding.
const ROUNDING: f64 = 1e-13;
/// A column whose part across the columns before it is this share or less of the longest depends on them, to rounding.
const DEPENDENT: f64 = 1e-15;

/// The `x` within `bounds` that makes `|a x - b|` smallest; `None` where the columns that bounds leave free depend on each
/// other.
///
/// The active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23) as Stark and Parker extend
/// it to boxes (Bounded-variable least squares, Computational Statistics 10, 1995): solve for the free parameters, stop at the
/// first bound that is met and hold that parameter there; when no bound is met, free the held parameter whose multiplier has
/// the wrong sign. Every pass lowers the cost, so no set of held parameters comes twice.
pub fn bounded(a: &DMatrix<f64>, b: &DVector<f64>, bounds: &Bounds) -> Option<DVector<f64>> {
    if a.nrows() > a.ncols() {
        let factors = a.clone().qr();
        let mut projected = b.clone();
        factors.q_tr_mul(&mut projected);
        let projected = projected.rows(0, a.ncols()).into_owned();
        return ActiveSet::new(&factors.r(), &projected, bounds).solution();
    }
    ActiveSet::new(a, b, bounds).solution()
}

/// The `x`, none of them negative, that makes `|a x - b|` smallest; `None` as of [`bounded`].
pub fn nonnegative(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let bounds = Bounds::new(vec![(0.0, f64::INFINITY); a.ncols()]);
    bounded(a, b, &bounds)
}

/// An `a` and a `b` with the normal equations `a' a = normal`, `a' b = right`, for who has only summed these; `None` where
/// `normal` is not positive definite.
pub fn normal_factor(
    normal: DMatrix<f64>,
    right: &DVector<f64>,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let lower = Cholesky::new(normal)?.unpack();
    let b = lower.solve_lower_triangular(right)?;
    Some((lower.transpose(), b))
}

struct ActiveSet<'a> {
    a: &'a DMatrix<f64>,
    b: &'a DVector<f64>,
    bounds: &'a Bounds,
    x: DVector<f64>,
    /// Parameters that no bound holds.
    free: Vec<usize>,
}

impl<'a> ActiveSet<'a> {
    fn new(a: &'a DMatrix<f64>, b: &'a DVector<f64>, bounds: &'a Bounds) -> Self {
        Self {
            a,
            b,
            bounds,
            x: bounds.clamp(&DVector::zeros(a.ncols())),
            free: (0..a.ncols())
                .filter(|&i| bounds.low(i) < bounds.high(i))
                .collect(),
        }
    }

    fn solution(mut self) -> Option<DVector<f64>> {
        self.descend()?;
        let mut cost = self.cost();
        while let Some(index) = self.wrongly_held() {
            let before = self.x.clone();
            self.free.push(index);
            self.descend()?;
            let after = self.cost();
            if after >= cost {
                return Some(before);
            }
            cost = after;
        }
        Some(self.x)
    }

    fn cost(&self) -> f64 {
        (self.a * &self.x - self.b).norm_squared()
    }

    /// Goes to the solution of the free parameters, holding those that meet a bound on the way.
    fn descend(&mut self) -> Option<()> {
        while !self.free.is_empty() {
            let target = self.unbounded()?;
            let share = |&(free, target): &(usize, f64)| {
                let (from, low, high) =
                    (self.x[free], self.bounds.low(free), self.bounds.high(free));
                let bound = target.clamp(low, high);
                if bound == target {
                    1.0
                } else {
                    (bound - from) / (target - from)
                }
            };
            let moves: Vec<_> = self
                .free
                .iter()
                .copied()
                .zip(target.iter().copied())
                .collect();
            let Some((blocking, part)) = moves
                .iter()
                .map(|pair| (pair.0, share(pair)))
                .filter(|(_, part)| *part < 1.0)
                .min_by(|a, b| a.1.total_cmp(&b.1))
            else {
                for (index, target) in moves {
                    self.x[index] = target;
                }
                return Some(());
            };
            for (index, target) in moves {
                let (low, high) = (self.bounds.low(index), self.bounds.high(index));
                self.x[index] = if index == blocking {
                    target.clamp(low, high)
                } else {
                    (self.x[index] + part * (target - self.x[index])).clamp(low, high)
                };
            }
            self.free.retain(|index| *index != blocking);
        }
        Some(())
    }

    /// The free parameters that are best if the others stay.
    fn unbounded(&self) -> Option<DVector<f64>> {
        let columns = self.a.select_columns(&self.free);
        let mut others = self.x.clone();
        for &index in &self.free {
            others[index] = 0.0;
        }
        let mut right = self.b - self.a * others;
        if columns.nrows() < columns.ncols() {
            return None;
        }
        let count = columns.ncols();
        let factors = columns.qr();
        factors.q_tr_mul(&mut right);
        let r = factors.r();
        let least = DEPENDENT * r.diagonal().amax();
        if r.diagonal().iter().any(|entry| entry.abs() <= least) {
            return None;
        }
        r.solve_upper_triangular(&right.rows(0, count))
    }

    /// The held parameter that most wants to leave its bound, into the box.
    fn wrongly_held(&self) -> Option<usize> {
        let left = self.b - self.a * &self.x;
        let scale = ROUNDING * self.b.norm();
        (0..self.x.len())
            .filter(|i| !self.free.contains(i))
            .filter_map(|i| {
                let column = self.a.column(i);
                let pull = column.dot(&left) / column.norm();
                let inward = (pull > 0.0 && self.x[i] < self.bounds.high(i))
                    || (pull < 0.0 && self.x[i] > self.bounds.low(i));
                (inward && pull.abs() > scale).then_some((i, pull.abs()))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{dmatrix, dvector};
    use proptest::prelude::*;

    #[test]
    fn without_a_bound_in_the_way_it_is_least_squares() {
        // The line through (0, 1), (1, 3), (2, 4), (3, 4) by the textbook's formulas: 1.5 + x.
        let a = dmatrix![1.0, 0.0; 1.0, 1.0; 1.0, 2.0; 1.0, 3.0];
        let b = dvector![1.0, 3.0, 4.0, 4.0];
        let x = bounded(&a, &b, &Bounds::none(2)).unwrap();
        assert_relative_eq!(x, dvector![1.5, 1.0], epsilon = 1e-14);
    }

    #[test]
    fn nonnegative_agrees_with_cases_worked_by_hand() {
        // Unconstrained (-1, 3) / 2: the first one goes to 0, the second one to its own mean, 2 / 2.
        let a = dmatrix![1.0, 1.0; 0.0, 2.0; 1.0, -1.0; 0.0, 0.0];
        let b = dvector![0.0, 2.0, -2.0, 5.0];
        // Column 2 alone: (0 + 4 + 2) / (1 + 4 + 1) = 1; column 1's multiplier there: (0 - 1) + (-2 + 1) = -2 < 0.
        let x = nonnegative(&a, &b).unwrap();
        assert_relative_eq!(x, dvector![0.0, 1.0], epsilon = 1e-14);
        // What leaves its zero first need not stay: the best single column is the sum of the two that are right.
        let a = dmatrix![1.0, 0.0, 0.9; 0.0, 1.0, 0.9; 0.0, 0.0, 0.1];
        let b = dvector![1.0, 1.0, 0.0];
        let x = nonnegative(&a, &b).unwrap();
        assert_relative_eq!(x, dvector![1.0, 1.0, 0.0], epsilon = 1e-12);
    }

    #[test]
    fn what_no_bound_determines_is_refused() {
        let a = dmatrix![1.0, 1.0; 2.0, 2.0; 3.0, 3.0];
        assert_eq!(nonnegative(&a, &dvector![1.0, 2.0, 3.0]), None);
        assert_eq!(nonnegative(&dmatrix![1.0, 1.0], &dvector![1.0]), None);
    }

    #[test]
    fn a_normal_matrix_has_its_factor() {
        let a = dmatrix![1.0, 0.5; 0.0, 2.0; 1.0, -1.0];
        let b = dvector![1.0, 2.0, -2.0];
        let (factor, right) = normal_factor(a.transpose() * &a, &(a.transpose() * &b)).unwrap();
        assert_relative_eq!(
            nonnegative(&factor, &right).unwrap(),
            nonnegative(&a, &b).unwrap(),
            epsilon = 1e-14
        );
        assert!(normal_factor(dmatrix![1.0, 2.0; 2.0, 1.0], &dvector![1.0, 1.0]).is_none());
    }

    /// The best over all choices of parameters at their bounds: the brute-force answer.
    fn exhaustive(a: &DMatrix<f64>, b: &DVector<f64>, low: f64, high: f64) -> f64 {
        let count = a.ncols() as u32;
        let mut best = f64::INFINITY;
        for choice in 0..3_u32.pow(count) {
            let state = |i: usize| choice / 3_u32.pow(i as u32) % 3;
            let fixed = DVector::from_fn(a.ncols(), |i, _| match state(i) {
                0 => low,
                1 => high,
                _ => 0.0,
            });
            let free: Vec<_> = (0..a.ncols()).filter(|&i| state(i) == 2).collect();
            let mut x = fixed.clone();
            if !free.is_empty() {
                let columns = a.select_columns(&free);
                let solution = columns
                    .svd(true, true)
                    .solve(&(b - a * &fixed), 0.0)
                    .unwrap();
                for (place, value) in free.into_iter().zip(solution.iter()) {
                    x[place] = *value;
                }
            }
            if x.iter().all(|x| (low..=high).contains(x)) {
                best = best.min((a * &x - b).norm());
            }
        }
        best
    }

    proptest! {
        #[test]
        fn bounded_finds_what_trying_all_sets_finds(
            entries in prop::collection::vec(-1.0..1.0_f64, 28),
            rights in prop::collection::vec(-2.0..2.0_f64, 7),
            high in 0.01..1.0_f64,
        ) {
            let a = DMatrix::from_vec(7, 4, entries);
            let b = DVector::from_vec(rights);
            let bounds = Bounds::new([(-0.3, high); 4]);
            let x = bounded(&a, &b, &bounds).unwrap();
            prop_assert_eq!(&bounds.clamp(&x), &x);
            // Rounding of seven rows of numbers around one.
            let (found, best) = ((&a * &x - &b).norm(), exhaustive(&a, &b, -0.3, high));
            prop_assert!((found - best).abs() < 1e-10, "{found} is not {best}");
        }
    }
}
