//! The refinement of a scanned candidate: damped Gauss-Newton steps of all its parameters, the base linear.
//!
//! The lab's solver minimises a Euclidean sum of squares. This one minimises `<r, r>` of a residual space, whose products of
//! a few slopes are cheap and whose residuals, written out, would have a row more for each member of the ensemble.

use super::Operating;
use super::explanation::{Explanation, PRICE, moved};
use crate::residual_space::{ResidualSpace, Session, Vector};
use mirror_model::effect::Active;
use nalgebra::{DMatrix, DVector};

/// Rounds, a simulation a parameter each: set by what they cost and by the figures of `cargo xtask bench diagnose`.
const ROUNDS: usize = 8;
/// A round that gains less than this, of scores of 25 and more, is the last.
const ENOUGH: f64 = 0.1;
/// Damping in parts of the normal matrix's diagonal at first, and how it changes after a good and a bad step (Marquardt 1963, who has 10
/// for both).
const DAMPING: f64 = 1e-3;
const EASED: f64 = 0.1;
const TIGHTENED: f64 = 30.0;
/// A ridge for a parameter that nothing depends on: far above the rounding of a double, far below what readings tell.
const RIDGE: f64 = 1e-9;
/// Difference step in parts of a parameter's usual size: above the noise of the simulation's step control.
const DIFFERENCE: f64 = 0.02;

/// The best values of an effect near a start, within its bounds.
pub(crate) fn refine(
    start: &Explanation<Session>,
    at: Operating,
    residual: &Vector<Session>,
    space: &ResidualSpace<Session>,
) -> Explanation<Session> {
    let change_of = |active: &Active| at.change(active).ok().map(|c| space.vector(&c));
    let price = PRICE * start.active.values.len() as f64;
    let score_of =
        |change: &Vector<Session>| 2.0 * change.dot(residual) - change.norm_squared() - price;
    let mut best = start.clone();
    let Some(first) = change_of(&best.active) else {
        return best;
    };
    best.score = score_of(&first);
    best.change = first;
    let mut damping = DAMPING;
    let mut slopes_of_best = None;
    for _ in 0..ROUNDS {
        let Some(slopes) = slopes_of_best.take().or_else(|| slopes(&best, &change_of)) else {
            break;
        };
        let Some(Step { step, strength }) = Step::of(&slopes, &(residual - &best.change), damping)
        else {
            break;
        };
        best.slope_error = strength * best.active.effect.info().parameters[0].start.abs();
        let moved = moved(&best.active, &step);
        let Some(change) = change_of(&moved) else {
            break;
        };
        let gain = score_of(&change) - best.score;
        if gain > 0.0 {
            best = Explanation {
                active: moved,
                score: best.score + gain,
                change,
                slope_error: best.slope_error,
            };
            damping *= EASED;
        } else {
            damping *= TIGHTENED;
            slopes_of_best = Some(slopes);
        }
        if (0.0..ENOUGH).contains(&gain) {
            break;
        }
    }
    best
}

/// A damped step, and the standard error of the strength, in units of the parameters' usual sizes.
struct Step {
    step: DVector<f64>,
    strength: f64,
}

impl Step {
    fn of(slopes: &[Vector<Session>], left: &Vector<Session>, damping: f64) -> Option<Self> {
        let count = slopes.len();
        let normal = DMatrix::from_fn(count, count, |i, j| {
            slopes[i].dot(&slopes[j]) + if i == j { RIDGE } else { 0.0 }
        });
        let damped = &normal + DMatrix::from_diagonal(&(normal.diagonal() * damping));
        let gradient = DVector::from_fn(count, |i, _| slopes[i].dot(left));
        Some(Self {
            step: damped.cholesky()?.solve(&gradient),
            strength: normal.cholesky()?.inverse()[(0, 0)].sqrt(),
        })
    }
}

/// Changes of the predictions with each parameter, in units of the parameter's usual size. Steps go into the range.
fn slopes(
    at: &Explanation<Session>,
    change_of: &impl Fn(&Active) -> Option<Vector<Session>>,
) -> Option<Vec<Vector<Session>>> {
    let parameters = at.active.effect.info().parameters.clone();
    parameters
        .iter()
        .enumerate()
        .map(|(index, parameter)| {
            let mut moved = at.active.clone();
            let is_high = moved.values[index] > 0.5 * (parameter.low + parameter.high);
            let inside = if is_high { -1.0 } else { 1.0 };
            let step = inside * DIFFERENCE * parameter.start.abs();
            moved.values[index] += step;
            let change = change_of(&moved)?;
            Some(&(&change - &at.change) * (parameter.start.abs() / step))
        })
        .collect()
}
