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

/// Whether a fit may move an effect's strength.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Strength {
    Free,
    Held,
}

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
    strength: Strength,
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
    let mut all = free_parameters(with.first()?, data);
    let base = all.len() - start.values.len();
    if strength == Strength::Held {
        all.remove(base);
    }
    let fitted = best_fit(&with, data, &data.values(), &all, precision).ok()?;
    let slopes = jacobian(&fitted.model, data, &all).ok()?;
    let count = all.len() - base;
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
    // Of a strength that is held slopes say nothing.
    let held = start.values.len() - count;
    let step = factor.solve(&gradient).insert_rows(0, held, 0.0);
    let slope_error = match strength {
        Strength::Free => {
            factor.inverse()[(0, 0)].sqrt() * start.effect.info().parameters[0].start.abs()
        }
        Strength::Held => f64::INFINITY,
    };
    let found = fitted.model.effects.last()?.clone();
    let (active, left) = match freely_moved(&found, &step) {
        Some(stepped) => {
            let slopes = own.iter().zip(step.iter().skip(held));
            let left = slopes.fold(residual, |left, (slope, &step)| &left - &(slope * step));
            (stepped, left)
        }
        None => (found, residual),
    };
    let explanation = Found {
        score: misfit - left.norm_squared() - PRICE * start.values.len() as f64,
        slope_error,
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
