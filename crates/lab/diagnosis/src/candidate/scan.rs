//! The scan of a candidate: which of its directions explains a residual best, and at which strength.

use super::direction::Direction;
use super::explanation::{Explanation, PRICE};
use crate::residual_space::{Kind, Vector};

/// A direction whose change is smaller than this shows nothing: 3 % of one reading's standard deviation, squared.
pub(super) const LEAST_WEIGHT: f64 = 1e-3;

/// An effect's directions, each with its own square, whatever residual it is to explain.
pub(crate) struct Scan<'a, K: Kind> {
    weighed: Vec<(&'a Direction<K>, f64)>,
}

/// A direction at its best strength.
struct Best<'a, K: Kind> {
    direction: &'a Direction<K>,
    weight: f64,
    /// Its strength, in usual ones.
    times: f64,
    /// By how much it lowers the misfit, less the price of its parameters.
    score: f64,
}

impl<'a, K: Kind> Scan<'a, K> {
    /// Of all that show anything.
    pub(crate) fn new(directions: &'a [Direction<K>]) -> Self {
        let weighed = directions.iter().map(|d| (d, d.change.norm_squared()));
        Self {
            weighed: weighed
                .filter(|(_, weight)| *weight >= LEAST_WEIGHT)
                .collect(),
        }
    }

    /// The best for a residual, where any shows.
    pub(crate) fn explanation(&self, residual: &Vector<K>) -> Option<Explanation<K>> {
        self.best(residual).map(Best::explanation)
    }

    /// What the best for a residual scores, 0 where none explains anything.
    pub(crate) fn score(&self, residual: &Vector<K>) -> f64 {
        self.best(residual).map_or(0.0, |best| best.score.max(0.0))
    }

    /// The change is linear in the strength, so its best value within its bounds has a closed form.
    fn best(&self, residual: &Vector<K>) -> Option<Best<'a, K>> {
        let each = self.weighed.iter().map(|&(direction, weight)| {
            let parameters = &direction.active.effect.info().parameters;
            let usual = direction.active.values[0];
            let along = direction.change.dot(residual);
            let (a, b) = (parameters[0].low / usual, parameters[0].high / usual);
            let times = (along / weight).clamp(a.min(b), a.max(b));
            let drop = 2.0 * times * along - times * times * weight;
            Best {
                direction,
                weight,
                times,
                score: drop - PRICE * parameters.len() as f64,
            }
        });
        each.max_by(|a, b| a.score.total_cmp(&b.score))
    }
}

impl<K: Kind> Best<'_, K> {
    fn explanation(self) -> Explanation<K> {
        let usual = self.direction.active.values[0];
        let mut active = self.direction.active.clone();
        active.values[0] = usual * self.times;
        Explanation {
            score: self.score,
            change: &self.direction.change * self.times,
            slope_error: usual.abs() / self.weight.sqrt(),
            active,
        }
    }
}
