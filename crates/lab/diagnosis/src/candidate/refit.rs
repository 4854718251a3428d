//! Base and effect fitted together, since a strong effect moves the base further than its slopes reach.

use super::explanation::{Explanation, PRICE, moved};
use crate::held_out::HeldOut;
use crate::null_ensemble::coordinates;
use crate::residual_space::{AroundRefit, Kind, ResidualSpace, Session, Vector};
use identification::dataset::Dataset;
use identification::fit::{Fitted, Precision, best_fit, free_parameters};
use identification::prediction::jacobian;
use mirror_model::Model;
use mirror_model::effect::Active;
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;

/// A ridge for a parameter that nothing depends on: far above the rounding of a double, far below what readings tell.
const RIDGE: f64 = 1e-6;
/// A step that ends further from where it was aimed than this has met a bound: rounding.
const BOUND: f64 = 1e-12;

/// Base and effect fitted together.
pub(crate) struct Refit {
    /// How closely.
    pub(crate) precision: Precision,
    /// The fit.
    pub(crate) fitted: Fitted,
    /// The space around the new fit.
    pub(crate) space: ResidualSpace<AroundRefit>,
    /// What is left, in that space.
    pub(crate) left: Vector<AroundRefit>,
    /// What is left on rows held out, once it was asked for.
    pub(crate) held_out: OnceLock<Option<HeldOut>>,
}

/// An effect as a fit together with the base finds it.
pub(crate) struct Found {
    active: Active,
    pub(crate) score: f64,
    slope_error: f64,
}

impl Found {
    /// An explanation, of which it is known what it changes.
    pub(crate) fn explanation<K: Kind>(self, change: Vector<K>) -> Explanation<K> {
        let Self {
            active,
            score,
            slope_error,
        } = self;
        Explanation {
            active,
            score,
            change,
            slope_error,
        }
    }
}

/// An effect after the best fit of base and effect together from these models, with one more step of the effect's parameters in
/// the space around that fit, where the discrepancy is free. `misfit` is the base's alone.
pub(crate) fn refit(
    start: &Active,
    models: &[Model],
    data: &Dataset,
    space: &ResidualSpace<Session>,
    misfit: f64,
    precision: Precision,
) -> Option<(Found, Refit)> {
    let mut with = models.to_vec();
    for model in &mut with {
        model.effects.push(start.clone());
    }
    let all = free_parameters(with.first()?, data);
    let fitted = best_fit(&with, data, &data.values(), &all, precision).ok()?;
    let slopes = jacobian(&fitted.model, data, &all).ok()?;
    let count = start.values.len();
    let base = all.len() - count;
    let space: ResidualSpace<AroundRefit> = space.around(&slopes.columns(0, base).into_owned());
    let at = coordinates(&fitted.model, data);
    let residual = space.residual(&fitted.standardised(data), &at);
    let own: Vec<_> = (base..all.len())
        .map(|column| space.vector(&slopes.column(column).into_owned()))
        .collect();
    let normal = DMatrix::from_fn(count, count, |i, j| {
        own[i].dot(&own[j]) + if i == j { RIDGE } else { 0.0 }
    });
    let gradient = DVector::from_fn(count, |i, _| own[i].dot(&residual));
    let factor = normal.cholesky()?;
    let step = factor.solve(&gradient);
    let found = fitted.model.effects.last()?.clone();
    let (active, left) = match freely_moved(&found, &step) {
        Some(stepped) => {
            let slopes = own.iter().zip(step.iter());
            let left = slopes.fold(residual, |left, (slope, &step)| &left - &(slope * step));
            (stepped, left)
        }
        None => (found, residual),
    };
    let explanation = Found {
        score: misfit - left.norm_squared() - PRICE * count as f64,
        slope_error: factor.inverse()[(0, 0)].sqrt()
            * active.effect.info().parameters[0].start.abs(),
        active,
    };
    let refit = Refit {
        precision,
        fitted,
        space,
        left,
        held_out: OnceLock::new(),
    };
    Some((explanation, refit))
}

/// The effect after a step, if no bound holds it back.
fn freely_moved(found: &Active, step: &DVector<f64>) -> Option<Active> {
    let stepped = moved(found, step);
    let parameters = found.effect.info().parameters.iter().zip(step.iter());
    let mut moves = stepped.values.iter().zip(&found.values).zip(parameters);
    moves
        .all(|((after, before), (p, step))| (after - before - step * p.start.abs()).abs() < BOUND)
        .then_some(stepped)
}
