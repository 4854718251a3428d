//! Jacobians by finite differences that never leave the bounds.

use crate::Bounds;
use nalgebra::{DMatrix, DVector};

/// How far a parameter is moved for its difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DifferenceStep {
    /// A share of the parameter, or as much of one where it is zero.
    Relative(f64),
    /// The same for all, as for logarithms.
    Absolute(f64),
}

impl DifferenceStep {
    /// For forward differences of functions that are exact to rounding: `sqrt(f64::EPSILON)`, where truncation and rounding
    /// are alike and leave 1e-8 of a derivative (Nocedal and Wright, Numerical Optimization, section 8.1).
    pub const FORWARD: Self = Self::Relative(1.5e-8);
    /// For central differences of such functions: the cube root of `f64::EPSILON`, which leaves 1e-10 (as above).
    pub const CENTRAL: Self = Self::Relative(6e-6);

    fn of(self, parameter: f64) -> f64 {
        match self {
            Self::Relative(share) if parameter == 0.0 => share,
            Self::Relative(share) => share * parameter.abs(),
            Self::Absolute(step) => step,
        }
    }
}

/// Derivatives by one more evaluation a parameter.
///
/// The step goes down where the upper bound is too close. A fixed parameter has a column of zeros.
pub fn forward_differences(
    f: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
    at: &DVector<f64>,
    here: &DVector<f64>,
    bounds: &Bounds,
    step: DifferenceStep,
) -> Option<DMatrix<f64>> {
    columns(at, here, |index| {
        let step = step.of(at[index]);
        let up = at[index] + step <= bounds.high(index);
        let (there, step) = moved(at, index, if up { step } else { -step });
        if there[index] < bounds.low(index) {
            return Some(DVector::zeros(here.len()));
        }
        Some((f(&there)? - here) / step)
    })
}

/// Derivatives by two more evaluations a parameter.
///
/// Close to a bound both points are on the side away from it, with the three-point formula, which is of second order too. A
/// parameter without room for that has a column of zeros.
pub fn central_differences(
    f: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
    at: &DVector<f64>,
    here: &DVector<f64>,
    bounds: &Bounds,
    step: DifferenceStep,
) -> Option<DMatrix<f64>> {
    columns(at, here, |index| {
        let step = step.of(at[index]);
        let room_below = at[index] - bounds.low(index);
        let room_above = bounds.high(index) - at[index];
        if room_below >= step && room_above >= step {
            let (above, up) = moved(at, index, step);
            let (below, down) = moved(at, index, -step);
            return Some((f(&above)? - f(&below)?) / (up - down));
        }
        if room_above.max(room_below) < 2.0 * step {
            return Some(DVector::zeros(here.len()));
        }
        let inward = if room_above >= room_below {
            step
        } else {
            -step
        };
        let (near, _) = moved(at, index, inward);
        let (far, twice) = moved(at, index, 2.0 * inward);
        Some((f(&near)? * 4.0 - here * 3.0 - f(&far)?) / twice)
    })
}

/// A point with one parameter moved, and by how much it moved indeed.
fn moved(at: &DVector<f64>, index: usize, step: f64) -> (DVector<f64>, f64) {
    let mut there = at.clone();
    there[index] += step;
    let step = there[index] - at[index];
    (there, step)
}

fn columns(
    at: &DVector<f64>,
    here: &DVector<f64>,
    column: impl Fn(usize) -> Option<DVector<f64>>,
) -> Option<DMatrix<f64>> {
    let mut jacobian = DMatrix::zeros(here.len(), at.len());
    for index in 0..at.len() {
        jacobian.set_column(index, &column(index)?);
    }
    Some(jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::dvector;

    fn f(at: &DVector<f64>) -> Option<DVector<f64>> {
        (at[0] <= 2.0).then(|| dvector![at[0].exp() * at[1], at[0] * at[0]])
    }

    fn derivatives(at: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_row_slice(2, 2, &[at[0].exp() * at[1], at[0].exp(), 2.0 * at[0], 0.0])
    }

    #[test]
    fn differences_are_the_derivatives_inside_and_at_a_bound() {
        let bounds = Bounds::new([(0.5, 2.0), (f64::NEG_INFINITY, f64::INFINITY)]);
        for x in [0.5, 1.3, 2.0] {
            let at = dvector![x, 0.0];
            let here = f(&at).unwrap();
            let exact = derivatives(&at);
            let forward =
                forward_differences(f, &at, &here, &bounds, DifferenceStep::FORWARD).unwrap();
            // Forward: the root of f64's rounding, 1.5e-8, times the curvature. Central, below: its power of two thirds, 4e-11.
            assert_relative_eq!(forward, exact, epsilon = 1e-7);
            let central =
                central_differences(f, &at, &here, &bounds, DifferenceStep::CENTRAL).unwrap();
            assert_relative_eq!(central, exact, epsilon = 1e-9);
        }
    }

    #[test]
    fn a_fixed_parameter_has_no_slope_and_is_not_moved() {
        let bounds = Bounds::new([(2.0, 2.0), (0.0, 9.0)]);
        let at = dvector![2.0, 3.0];
        let here = f(&at).unwrap();
        for jacobian in [
            forward_differences(f, &at, &here, &bounds, DifferenceStep::FORWARD).unwrap(),
            central_differences(f, &at, &here, &bounds, DifferenceStep::CENTRAL).unwrap(),
        ] {
            assert_eq!(jacobian.column(0).norm(), 0.0);
            assert!(jacobian.column(1).norm() > 1.0);
        }
    }

    #[test]
    fn what_has_no_answer_has_no_jacobian() {
        let at = dvector![2.0, 1.0];
        let here = f(&at).unwrap();
        let bounds = Bounds::none(2);
        assert_eq!(
            forward_differences(f, &at, &here, &bounds, DifferenceStep::FORWARD),
            None
        );
    }
}
