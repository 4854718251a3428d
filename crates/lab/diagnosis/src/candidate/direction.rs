//! What an effect changes in the base's predictions, at chosen values of its form.

use crate::residual_space::{Kind, ResidualSpace, Vector};
use identification::dataset::Dataset;
use identification::prediction::{predict, standardised};
use mirror_model::effect::{Active, Effect, Parameter};
use mirror_model::{Model, Runaway};
use nalgebra::DVector;
use rayon::prelude::*;
use std::sync::Arc;

/// Starts of the first parameter of an effect's form, between its bounds. Further parameters start at their usual values.
/// Set by the figures of `cargo xtask bench diagnose`.
const STARTS: usize = 8;
/// Starts of a frequency, denser: what rings is only found from within its line.
const STARTS_OF_A_FREQUENCY: usize = 32;

/// Where effects are tried: a fitted model, and what it predicts.
#[derive(Clone, Copy)]
pub(crate) struct Operating<'a> {
    pub(crate) model: &'a Model,
    pub(crate) data: &'a Dataset,
    /// Predictions of the base (um, A).
    pub(crate) base: &'a [f64],
}

/// An effect at chosen values of its form, with the change that its usual strength makes.
#[derive(Clone)]
pub(crate) struct Direction<K: Kind> {
    /// The effect at its usual strength.
    pub(crate) active: Active,
    /// Predictions with it less those without.
    pub(crate) change: Vector<K>,
}

impl<K: Kind> Direction<K> {
    /// The same direction in another space with the same covariance.
    pub(crate) fn seen_in<L: Kind<Rows = K::Rows>>(
        &self,
        space: &ResidualSpace<L>,
    ) -> Direction<L> {
        Direction {
            change: space.import(&self.change),
            active: self.active.clone(),
        }
    }

    /// The same direction in a space that weighs rows in its own way.
    pub(crate) fn weighed_by<L: Kind>(
        &self,
        own: &ResidualSpace<K>,
        other: &ResidualSpace<L>,
    ) -> Direction<L> {
        Direction {
            change: other.vector(&own.standardised(&self.change)),
            active: self.active.clone(),
        }
    }
}

impl Operating<'_> {
    /// The directions of an effect, one a start of its form.
    pub(crate) fn directions<K: Kind>(
        &self,
        effect: &Arc<dyn Effect>,
        space: &ResidualSpace<K>,
    ) -> Vec<Direction<K>>
    where
        Direction<K>: Send,
        ResidualSpace<K>: Sync,
    {
        from_all_starts(effect)
            .into_par_iter()
            .filter_map(|active| {
                let change = space.vector(&self.change(&active).ok()?);
                Some(Direction { active, change })
            })
            .collect()
    }

    /// What an effect adds to the base's predictions, standardised.
    pub(crate) fn change(&self, active: &Active) -> Result<DVector<f64>, Runaway> {
        let mut with = self.model.clone();
        with.effects.push(active.clone());
        let predicted = predict(&with, self.data)?;
        let added = predicted
            .iter()
            .zip(self.base)
            .map(|(with, without)| with - without);
        Ok(standardised(added, self.data))
    }
}

/// The usual strength with every combination of starts of the other parameters.
pub(crate) fn from_all_starts(effect: &Arc<dyn Effect>) -> Vec<Active> {
    let parameters = effect.info().parameters.clone();
    let mut forms = vec![Active::usual(effect.clone())];
    for (index, parameter) in parameters.iter().enumerate().skip(1) {
        let starts = starts(index, parameter);
        forms = forms
            .iter()
            .flat_map(|form| {
                starts.iter().map(|&value| {
                    let mut form = form.clone();
                    form.values[index] = value;
                    form
                })
            })
            .collect();
    }
    forms
}

/// Evenly spread between the bounds; in ratios where these are positive.
fn starts(index: usize, parameter: &Parameter) -> Vec<f64> {
    let count = match index {
        1 if parameter.unit == "Hz" => STARTS_OF_A_FREQUENCY,
        1 => STARTS,
        _ => return vec![parameter.start],
    };
    let spread = |step: usize| {
        let share = (step as f64 + 0.5) / count as f64;
        if parameter.low > 0.0 {
            parameter.low * (parameter.high / parameter.low).powf(share)
        } else {
            parameter.low + share * (parameter.high - parameter.low)
        }
    };
    (0..count).map(spread).collect()
}
