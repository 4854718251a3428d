//! Effects as candidates: what each would add to the base's predictions, and how much of a misfit that explains.

use crate::fit::{Fitted, fit_knobs, in_units_of_trust, jacobian, knobs, predict};
use crate::plan::Plan;
use crate::space::{Space, Vector};
use mirror_model::effect::{Active, Effect};
use mirror_model::{Model, Runaway};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// Starts for each parameter of an effect's form, between its bounds.
const STARTS: usize = 8;
/// Starts for a frequency: what rings is only found from within its line.
const STARTS_OF_A_FREQUENCY: usize = 32;
/// A parameter costs so much of the drop of the misfit (half of it is AIC's price, two thirds of it BIC's for 8000 rows).
pub const PRICE: f64 = 6.0;
/// Rounds of refinement from the best start.
const ROUNDS: usize = 8;

/// An effect at chosen values of its form, with the change that its usual strength makes.
#[derive(Clone)]
pub struct Direction {
    /// The effect at its usual strength.
    pub active: Active,
    /// Predictions with it less those without, in a space.
    pub change: Vector,
}

/// How well an effect explains a misfit.
#[derive(Clone)]
pub struct Explanation {
    /// The effect with its best values.
    pub active: Active,
    /// Drop of the misfit, less the price of the parameters.
    pub score: f64,
    /// What it changes at its best values.
    pub change: Vector,
    /// One standard deviation of its strength.
    pub strength_error: f64,
    /// What is left when base and effect are fitted together, where that was done.
    pub refit: Option<Arc<Refit>>,
}

/// Base and effect fitted together.
pub struct Refit {
    /// The fit.
    pub fitted: Fitted,
    /// The space around the new fit.
    pub space: Space,
    /// What is left, in that space.
    pub left: Vector,
}

/// The directions of an effect around a fitted base, one a start of its form.
pub fn directions(
    effect: &Arc<dyn Effect>,
    model: &Model,
    plan: &Plan,
    base: &[f64],
    space: &Space,
) -> Vec<Direction> {
    forms(effect)
        .into_par_iter()
        .filter_map(|active| {
            let change = space.vector(&change(&active, model, plan, base).ok()?);
            Some(Direction { active, change })
        })
        .collect()
}

/// The usual strength with every combination of starts of the other parameters.
fn forms(effect: &Arc<dyn Effect>) -> Vec<Active> {
    let parameters = effect.info().parameters.clone();
    let mut forms = vec![Active::usual(effect.clone())];
    for (index, parameter) in parameters.iter().enumerate().skip(1) {
        let starts = match index {
            1 if parameter.unit == "Hz" => STARTS_OF_A_FREQUENCY,
            1 => STARTS,
            _ => 1,
        };
        let spread = |step: usize| {
            let share = (step as f64 + 0.5) / starts as f64;
            if parameter.low > 0.0 {
                parameter.low * (parameter.high / parameter.low).powf(share)
            } else {
                parameter.low + share * (parameter.high - parameter.low)
            }
        };
        forms = forms
            .iter()
            .flat_map(|form| {
                (0..starts).map(move |step| {
                    let mut form = form.clone();
                    form.values[index] = if starts == 1 {
                        parameter.start
                    } else {
                        spread(step)
                    };
                    form
                })
            })
            .collect();
    }
    forms
}

impl Direction {
    /// The same direction, so far in one space, in another one that weighs rows in its own way.
    pub fn weighed_by(&self, so_far: &Space, space: &Space) -> Self {
        Self {
            change: space.vector(&so_far.unscaled(&self.change)),
            active: self.active.clone(),
        }
    }

    /// The same direction in another space with the same approximation.
    pub fn seen_in(&self, space: &Space) -> Self {
        Self {
            change: space.of(self.change.clone()),
            active: self.active.clone(),
        }
    }
}

/// What an effect adds to the base's predictions, in units of trust.
fn change(
    active: &Active,
    model: &Model,
    plan: &Plan,
    base: &[f64],
) -> Result<DVector<f64>, Runaway> {
    let mut with = model.clone();
    with.effects.push(active.clone());
    let predicted = predict(&with, plan)?;
    let added = predicted
        .iter()
        .zip(base)
        .map(|(with, without)| with - without);
    Ok(in_units_of_trust(added, plan))
}

/// The best of an effect's directions for a residual, its strength within its bounds: linear in the strength, so cheap.
pub fn scan(directions: &[Direction], residual: &Vector, space: &Space) -> Option<Explanation> {
    directions
        .iter()
        .filter_map(|direction| {
            let parameters = &direction.active.effect.info().parameters;
            let usual = direction.active.values[0];
            let weight = space.product(&direction.change, &direction.change);
            if weight < 1e-3 {
                return None;
            }
            let along = space.product(&direction.change, residual);
            let (a, b) = (parameters[0].low / usual, parameters[0].high / usual);
            let times = (along / weight).clamp(a.min(b), a.max(b));
            let drop = 2.0 * times * along - times * times * weight;
            let mut active = direction.active.clone();
            active.values[0] = usual * times;
            Some(Explanation {
                score: drop - PRICE * parameters.len() as f64,
                change: &direction.change * times,
                strength_error: usual.abs() / weight.sqrt(),
                refit: None,
                active,
            })
        })
        .max_by(|a, b| a.score.total_cmp(&b.score))
}

/// Gauss-Newton over all of an effect's parameters from a scanned start, within its bounds.
pub fn refine(
    start: &Explanation,
    model: &Model,
    plan: &Plan,
    base: &[f64],
    residual: &Vector,
    space: &Space,
) -> Explanation {
    let price = PRICE * start.active.values.len() as f64;
    let change_of = |active: &Active| {
        change(active, model, plan, base)
            .ok()
            .map(|c| space.vector(&c))
    };
    let drop_of =
        |change: &Vector| 2.0 * space.product(change, residual) - space.product(change, change);
    let mut best = start.clone();
    let Some(first) = change_of(&best.active) else {
        return best;
    };
    best.score = drop_of(&first) - price;
    best.change = first;
    let scale = best.active.effect.info().parameters[0].start.abs();
    let mut damping = 1e-3;
    let mut slopes_of_best = None;
    for _ in 0..ROUNDS {
        let Some(slopes) = slopes_of_best.take().or_else(|| slopes(&best, &change_of)) else {
            break;
        };
        let left = residual - &best.change;
        let count = slopes.len();
        let normal = DMatrix::from_fn(count, count, |i, j| {
            space.product(&slopes[i], &slopes[j]) + if i == j { 1e-9 } else { 0.0 }
        });
        let damped = &normal + DMatrix::from_diagonal(&(normal.diagonal() * damping));
        let gradient = DVector::from_fn(count, |i, _| space.product(&slopes[i], &left));
        let (Some(factor), Some(free)) = (damped.cholesky(), normal.cholesky()) else {
            break;
        };
        best.strength_error = free.inverse()[(0, 0)].sqrt() * scale;
        let moved = moved(&best.active, &factor.solve(&gradient));
        let Some(change) = change_of(&moved) else {
            break;
        };
        let gain = drop_of(&change) - price - best.score;
        if gain > 0.0 {
            best = Explanation {
                active: moved,
                score: best.score + gain,
                change,
                strength_error: best.strength_error,
                refit: None,
            };
            damping *= 0.1;
        } else {
            damping *= 30.0;
            slopes_of_best = Some(slopes);
        }
        if (0.0..0.1).contains(&gain) {
            break;
        }
    }
    best
}

/// Fits base and effect together, since a strong effect moves the base further than its slopes reach; then one step of the
/// effect's parameters in the space around the new fit. `misfit` is the base's alone.
pub fn refit(
    start: &Explanation,
    model: &Model,
    plan: &Plan,
    space: &Space,
    misfit: f64,
) -> Option<Explanation> {
    let mut with = model.clone();
    with.effects.push(start.active.clone());
    let all = knobs(&with, plan);
    let fitted = fit_knobs(&with, plan, &plan.values(), &all).ok()?;
    let slopes = jacobian(&fitted.model, plan, &all).ok()?;
    let count = start.active.values.len();
    let base = all.len() - count;
    let space = space.around(&slopes.columns(0, base).into_owned());
    let residual = space.vector(&fitted.scaled(plan));
    let own: Vec<Vector> = (base..all.len())
        .map(|column| space.vector(&slopes.column(column).into_owned()))
        .collect();
    let normal = DMatrix::from_fn(count, count, |i, j| {
        space.product(&own[i], &own[j]) + if i == j { 1e-6 } else { 0.0 }
    });
    let gradient = DVector::from_fn(count, |i, _| space.product(&own[i], &residual));
    let factor = normal.cholesky()?;
    let step = factor.solve(&gradient);
    let found = fitted.model.effects.last()?.clone();
    let stepped = moved(&found, &step);
    let free = stepped
        .values
        .iter()
        .zip(&found.values)
        .zip(found.effect.info().parameters.iter().zip(step.iter()))
        .all(|((after, before), (p, step))| (after - before - step * p.start.abs()).abs() < 1e-12);
    let (active, left) = if free {
        let left = own
            .iter()
            .zip(step.iter())
            .fold(residual, |left, (slope, &step)| &left - &(slope * step));
        (stepped, left)
    } else {
        (found, residual)
    };
    let after = space.product(&left, &left);
    Some(Explanation {
        score: misfit - after - PRICE * count as f64,
        change: start.change.clone(),
        strength_error: factor.inverse()[(0, 0)].sqrt()
            * active.effect.info().parameters[0].start.abs(),
        active,
        refit: Some(Arc::new(Refit {
            fitted,
            space,
            left,
        })),
    })
}

/// Changes of the predictions with each parameter, in units of the parameter's usual size.
fn slopes(at: &Explanation, change_of: &impl Fn(&Active) -> Option<Vector>) -> Option<Vec<Vector>> {
    let parameters = at.active.effect.info().parameters.clone();
    (0..parameters.len())
        .map(|index| {
            let mut moved = at.active.clone();
            let inside =
                if moved.values[index] > 0.5 * (parameters[index].low + parameters[index].high) {
                    -1.0
                } else {
                    1.0
                };
            let step = inside * 0.02 * parameters[index].start.abs();
            moved.values[index] += step;
            let change = change_of(&moved)?;
            Some(&(&change - &at.change) * (parameters[index].start.abs() / step))
        })
        .collect()
}

fn moved(active: &Active, step: &DVector<f64>) -> Active {
    let mut moved = active.clone();
    for ((value, parameter), step) in moved
        .values
        .iter_mut()
        .zip(active.effect.info().parameters.iter())
        .zip(step.iter())
    {
        *value = (*value + step * parameter.start.abs()).clamp(parameter.low, parameter.high);
    }
    moved
}
