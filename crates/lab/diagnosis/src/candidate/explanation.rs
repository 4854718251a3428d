//! How an effect explains a misfit: its values, what that is worth, and what it changes.

use crate::quantile::TOLD;
use crate::residual_space::{Kind, Vector};
use mirror_model::effect::Active;
use nalgebra::DVector;

/// What a parameter costs of the drop of the misfit: three times AIC's 2 (K. Burnham and D. Anderson, "Model Selection and
/// Multimodel Inference" (2002), section 2.2), since the best of many starts of a form is taken; BIC's for 400 readings
/// (ln 400 = 6).
pub(crate) const PRICE: f64 = 6.0;

/// How well an effect explains a misfit.
#[derive(Clone)]
pub(crate) struct Explanation<K: Kind> {
    /// The effect with its best values.
    pub(crate) active: Active,
    /// Drop of the misfit, less the price of the parameters.
    pub(crate) score: f64,
    /// What it changes at its best values.
    pub(crate) change: Vector<K>,
    /// Standard error of its strength by slopes, in its unit.
    pub(crate) slope_error: f64,
}

impl<K: Kind> Explanation<K> {
    /// Standard error of its strength, in its unit, where errors are so many times as wide as noise alone makes them. Where a
    /// strength is known to a factor and not to a part of itself, slopes say nothing of its distance from zero; the drop of
    /// the misfit does, by its signed root (O. Barndorff-Nielsen and D. Cox, "Inference and Asymptotics" (1994), section 3.3).
    /// Where the strength acts linearly the two are the same.
    pub(crate) fn strength_error(&self, widening: f64) -> f64 {
        let strength = self.active.values[0].abs();
        let drop = self.score + PRICE * self.active.values.len() as f64;
        let of_drop = strength / drop.max(f64::MIN_POSITIVE).sqrt();
        widening * self.slope_error.min(of_drop)
    }

    /// Whether its strength is not zero.
    pub(crate) fn is_told_from_zero(&self, widening: f64) -> bool {
        self.active.values[0].abs() > TOLD * self.strength_error(widening)
    }
}

/// The effect with its parameters moved, each by so many of its usual size, within their bounds.
pub(super) fn moved(active: &Active, step: &DVector<f64>) -> Active {
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
