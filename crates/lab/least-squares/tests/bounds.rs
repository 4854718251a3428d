//! Bounds, priors, points without an answer, and secant updates.

use approx::assert_relative_eq;
use least_squares::{
    Bounds, JacobianUpdates, MinimiseError, Options, Prior, Problem, Solution, Termination,
    minimise,
};
use nalgebra::{DMatrix, DVector, dvector};
use std::cell::Cell;

/// Rosenbrock's valley: 0 at (1, 1), and along it from anywhere.
#[expect(clippy::unnecessary_wraps, reason = "a problem may have no answer")]
fn valley(at: &DVector<f64>) -> Option<DVector<f64>> {
    Some(dvector![10.0 * (at[1] - at[0] * at[0]), 1.0 - at[0]])
}

fn within(ranges: [(f64, f64); 2]) -> Options {
    Options {
        bounds: Some(Bounds::new(ranges)),
        ..Options::default()
    }
}

fn minimised(start: [f64; 2], options: &Options) -> Solution {
    minimise(&valley, &DVector::from_column_slice(&start), options).unwrap()
}

const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

// Forward differences give a slope to about 1e-8, and so the place where it vanishes.
const PLACE: f64 = 1e-6;

#[test]
fn inside_its_bounds_the_optimum_is_the_free_one() {
    let found = minimised([-1.2, 1.0], &within([(-2.0, 2.0), ANYWHERE]));
    assert_relative_eq!(found.parameters, dvector![1.0, 1.0], epsilon = PLACE);
    assert!(found.termination.is_converged());
    assert_eq!(found.held, [false, false]);
}

#[test]
fn an_optimum_on_a_bound_is_found_exactly_there() {
    // With x <= 0.5 the best is x = 0.5, and y = x^2 at no cost.
    let found = minimised([-1.2, 1.0], &within([(-2.0, 0.5), ANYWHERE]));
    assert_eq!(found.parameters[0], 0.5);
    assert_relative_eq!(found.parameters[1], 0.25, epsilon = PLACE);
    assert_eq!(found.held, [true, false]);
    assert_relative_eq!(found.cost, 0.25, epsilon = PLACE);
    // With y >= 1.5 instead: 100 (1.5 - x^2)^2 + (1 - x)^2 has its derivative's root at 1.2243748.
    let found = minimised([2.0, 2.0], &within([ANYWHERE, (1.5, 9.0)]));
    assert_eq!(found.parameters[1], 1.5);
    let x = found.parameters[0];
    assert_relative_eq!(
        400.0 * x * (x * x - 1.5) + 2.0 * (x - 1.0),
        0.0,
        epsilon = 1e-3
    );
    assert_eq!(found.held, [false, true]);
}

#[test]
fn a_start_on_a_bound_leaves_it_and_one_outside_begins_at_it() {
    for start in [[-2.0, 4.0], [-7.0, 90.0]] {
        let found = minimised(start, &within([(-2.0, 2.0), (-1.0, 4.0)]));
        assert_relative_eq!(found.parameters, dvector![1.0, 1.0], epsilon = PLACE);
    }
}

#[test]
fn what_is_fixed_stays_and_with_all_fixed_nothing_is_tried() {
    let found = minimised([0.3, 5.0], &within([(0.3, 0.3), ANYWHERE]));
    assert_eq!(found.parameters[0], 0.3);
    assert_relative_eq!(found.parameters[1], 0.09, epsilon = PLACE);
    let found = minimised([0.3, 5.0], &within([(0.3, 0.3), (5.0, 5.0)]));
    assert_eq!(found.parameters, dvector![0.3, 5.0]);
    assert_eq!(found.termination, Termination::AllHeld);
    assert_eq!(found.evaluations, 1);
    assert_eq!(found.covariance().unwrap(), DMatrix::zeros(2, 2));
}

#[test]
fn a_point_without_an_answer_rejects_the_step() {
    // A wall inside the first step of a method without a trust region, in three ways of saying so.
    for answer in [None, Some(f64::NAN), Some(f64::INFINITY)] {
        let rejected = Cell::new(0);
        let walled = |at: &DVector<f64>| {
            if at[1] < -1.5 || at[0] > 1.5 {
                rejected.set(rejected.get() + 1);
                return answer.map(|answer| dvector![answer, 0.0]);
            }
            valley(at)
        };
        let options = Options {
            first_radius: 1e9,
            ..Options::default()
        };
        let found = minimise(&walled, &dvector![-1.2, 1.0], &options).unwrap();
        assert_relative_eq!(found.parameters, dvector![1.0, 1.0], epsilon = PLACE);
        assert!(rejected.get() > 0, "the wall was never met");
    }
}

#[test]
fn a_start_without_an_answer_is_refused() {
    let nowhere = |_: &DVector<f64>| None;
    let refused = minimise(&nowhere, &dvector![1.0], &Options::default()).unwrap_err();
    assert_eq!(refused, MinimiseError::NoResiduals);
    let alone = |at: &DVector<f64>| (at[0] == 1.0).then(|| dvector![1.0]);
    let refused = minimise(&alone, &dvector![1.0], &Options::default()).unwrap_err();
    assert_eq!(refused, MinimiseError::NoJacobian);
}

#[test]
fn a_prior_weighs_as_one_measurement_more() {
    // A mean of three readings of standard deviation 1 around 4, and a prior of 0 +- 1/sqrt(3): they meet half way.
    let readings = |at: &DVector<f64>| Some(dvector![at[0] - 3.0, at[0] - 4.0, at[0] - 5.0]);
    let options = Options {
        prior: Some(Prior::around(dvector![0.0], 3.0_f64.sqrt().recip())),
        ..Options::default()
    };
    let found = minimise(&readings, &dvector![9.0], &options).unwrap();
    assert_relative_eq!(found.parameters[0], 2.0, epsilon = PLACE);
    assert_eq!(found.residuals.len(), 3);
    assert_relative_eq!(found.covariance().unwrap()[0], 1.0 / 6.0, epsilon = PLACE);
    // 1 + 4 + 9 of the readings and 4 * 3 of the prior.
    assert_relative_eq!(found.cost, 26.0, epsilon = PLACE);
}

#[test]
fn no_step_is_longer_than_it_may_be() {
    let last = Cell::new(-1.2_f64);
    let longest = Cell::new(0.0_f64);
    struct Watched<'a>(&'a Cell<f64>, &'a Cell<f64>);
    impl Problem for Watched<'_> {
        fn residuals(&self, at: &DVector<f64>) -> Option<DVector<f64>> {
            self.1.set(self.1.get().max((at[0] - self.0.get()).abs()));
            valley(at)
        }

        fn jacobian(
            &self,
            at: &DVector<f64>,
            _: &DVector<f64>,
            _: &Bounds,
        ) -> Option<DMatrix<f64>> {
            self.0.set(at[0]);
            Some(DMatrix::from_row_slice(
                2,
                2,
                &[-20.0 * at[0], 10.0, -1.0, 0.0],
            ))
        }
    }
    let options = Options {
        longest_step: 0.25,
        ..Options::default()
    };
    let found = minimise(&Watched(&last, &longest), &dvector![-1.2, 1.0], &options).unwrap();
    assert_relative_eq!(found.parameters, dvector![1.0, 1.0], epsilon = PLACE);
    // Exactly as long where the bound acts, but for the rounding of two subtractions.
    assert_relative_eq!(longest.get(), 0.25, epsilon = 1e-12);
}

#[test]
fn secant_updates_save_jacobians_and_end_at_the_same_place() {
    // A decay seen at ten times: 3 exp(-0.7 t) + 1.
    let curve = |b: &DVector<f64>, t: f64| b[0] * (-b[1] * t).exp() + b[2];
    let truth = dvector![3.0, 0.7, 1.0];
    let decay = |b: &DVector<f64>| {
        Some(DVector::from_fn(10, |i, _| {
            let t = 0.5 * i as f64;
            curve(b, t) - curve(&truth, t) - 0.01 * (7.0 * t).sin()
        }))
    };
    let start = dvector![1.0, 0.3, 0.0];
    let each = minimise(&decay, &start, &Options::default()).unwrap();
    let secant = Options {
        updates: JacobianUpdates::Secant { refresh: 5 },
        ..Options::default()
    };
    let now_and_then = minimise(&decay, &start, &secant).unwrap();
    assert!(now_and_then.jacobians < each.jacobians);
    assert_relative_eq!(now_and_then.parameters, each.parameters, epsilon = PLACE);
    // Beginning with the Jacobian of a fit close by; it is computed once more at least before the fit ends.
    let followed = Options {
        first_jacobian: Some(each.jacobian.clone()),
        ..secant
    };
    let again = minimise(&decay, &start, &followed).unwrap();
    assert!(again.jacobians >= 1);
    assert_relative_eq!(again.parameters, each.parameters, epsilon = PLACE);
}

#[test]
fn the_same_fit_is_the_same_to_the_last_digit() {
    let fit = || minimised([-1.2, 1.0], &within([(-2.0, 0.9), (-1.0, 4.0)]));
    assert_eq!(fit().parameters, fit().parameters);
}

/// `ln x` towards -2, with slopes down to `x = 0.5` only.
struct Cliff;

impl Problem for Cliff {
    fn residuals(&self, at: &DVector<f64>) -> Option<DVector<f64>> {
        Some(dvector![at[0].ln() + 2.0])
    }

    fn jacobian(&self, at: &DVector<f64>, _: &DVector<f64>, _: &Bounds) -> Option<DMatrix<f64>> {
        (at[0] > 0.5).then(|| DMatrix::from_element(1, 1, 1.0 / at[0]))
    }
}

#[test]
fn a_step_to_where_the_model_has_no_slopes_is_not_taken() {
    let found = minimise(&Cliff, &dvector![1.0], &within_one((0.1, 9.0))).unwrap();
    // At the edge; the last step, shorter than the tolerance of 1e-10, may end beyond it.
    assert!(
        (0.5 - 1e-9..0.6).contains(&found.parameters[0]),
        "{found:?}"
    );
}

fn within_one(range: (f64, f64)) -> Options {
    Options {
        bounds: Some(Bounds::new([range])),
        ..Options::default()
    }
}
