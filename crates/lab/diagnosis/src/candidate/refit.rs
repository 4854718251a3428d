//! Base and effect fitted together, since a strong effect moves the base further than its slopes reach.

use super::explanation::{Explanation, PRICE, moved};
use crate::held_out::HeldOut;
use crate::null_ensemble::coordinates;
use crate::residual_space::{AroundRefit, Kind, ResidualSpace, Session, Vector};
use identification::dataset::Dataset;
use identification::fit::{Fitted, fit_parameters, free_parameters};
use identification::prediction::jacobian;
use mirror_model::Model;
use mirror_model::effect::Active;
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;

/// A ridge for a parameter that nothing depends on.
const RIDGE: f64 = 1e-6;
/// A step that ends further from where it was aimed than this has met a bound: rounding.
const BOUND: f64 = 1e-12;

/// Base and effect fitted together.
pub(crate) struct Refit {
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

/// An effect after the fit of base and effect together from this model, with one more step of the effect's parameters in the
/// space around that fit, where the discrepancy is free. `misfit` is the base's alone.
pub(crate) fn refit(
    start: &Active,
    model: &Model,
    data: &Dataset,
    space: &ResidualSpace<Session>,
    misfit: f64,
) -> Option<(Found, Refit)> {
    let mut with = model.clone();
    with.effects.push(start.clone());
    let all = free_parameters(&with, data);
    let fitted = fit_parameters(&with, data, &data.values(), &all).ok()?;
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
