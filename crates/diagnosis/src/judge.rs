//! Mirrors with nothing hidden as judges: each family in the space that the other families span, as if a user's mirror came
//! from a family that nobody has seen.

use crate::candidate::{Direction, scan};
use crate::ensemble::Ensemble;
use crate::family::CALIBRATING;
use crate::plan::{Channel, Observation, Plan};
use crate::space::{Space, Vector};
use mirror_model::effect::Effect;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

/// Of mirrors with nothing hidden, this share must stay without a named effect.
const QUIET: f64 = 0.95;
/// A hundred mirrors know their own quantile only so well: an amplitude must exceed it by so many standard deviations.
const MARGIN: f64 = 1.64;
/// No score below this is evidence, however quiet the virtual mirrors are: few readings leave them no room to show
/// anything, and a real mirror comes from no family.
const FLOOR: f64 = 60.0;
/// Groups of rows take as their own noise what this share of the mirrors of an unseen family leave there at most.
const LEFTOVER: f64 = 0.8;

/// Mirrors of one family in the space that the other families span.
pub(crate) struct Judge {
    space: Space,
    quiet: Vec<Vector>,
}

/// One judge a family, and the noise of all rows. Each group of rows (an experiment's displacement, its currents) has as
/// noise, beside its white noise, what mirrors of an unseen family leave there after base and approximation.
pub(crate) fn judges(
    plan: &Plan,
    ensemble: &Ensemble,
    slopes: &DMatrix<f64>,
    white: &DVector<f64>,
) -> (Vec<Judge>, DVector<f64>) {
    let folds: Vec<_> = (0..CALIBRATING.len())
        .map(|family| ensemble.leave_out(family))
        .collect();
    let left: Vec<Vec<f64>> = folds
        .par_iter()
        .flat_map(|(judging, spanning)| {
            let space = Space::new(slopes, spanning, &DVector::repeat(white.len(), 1.0));
            judging
                .column_iter()
                .map(|column| squares_by_group(plan, &space.remainder(&column.into_owned())))
                .collect::<Vec<_>>()
        })
        .collect();
    let leftovers: Vec<f64> = (0..2 * plan.experiments.len())
        .map(|group| {
            let mut squares: Vec<f64> = left.iter().map(|groups| groups[group]).collect();
            squares.sort_by(f64::total_cmp);
            quantile(&squares, LEFTOVER)
        })
        .collect();
    let rows = plan
        .observations
        .iter()
        .zip(white.iter())
        .map(|(o, w)| (w * w + leftovers[group(o)]).sqrt());
    let noise = DVector::from_iterator(white.len(), rows);
    let judges = folds
        .par_iter()
        .enumerate()
        .map(|(family, (judging, spanning))| {
            let space = Space::new(slopes, spanning, &noise);
            let mut rng = ChaCha8Rng::seed_from_u64(family as u64);
            let mut noisy = |column: DVector<f64>| {
                column
                    + white.map(|sigma| {
                        sigma
                            * <StandardNormal as Distribution<f64>>::sample(
                                &StandardNormal,
                                &mut rng,
                            )
                    })
            };
            let quiet = judging
                .column_iter()
                .map(|column| space.vector(&noisy(column.into_owned())))
                .collect();
            Judge { space, quiet }
        })
        .collect();
    (judges, noise)
}

fn group(observation: &Observation) -> usize {
    2 * observation.experiment + usize::from(observation.channel == Channel::Displacement)
}

fn squares_by_group(plan: &Plan, remainder: &DVector<f64>) -> Vec<f64> {
    let mut sums = vec![(0.0, 0usize); 2 * plan.experiments.len()];
    for (value, o) in remainder.iter().zip(&plan.observations) {
        sums[group(o)].0 += value * value;
        sums[group(o)].1 += 1;
    }
    sums.into_iter()
        .map(|(sum, count)| sum / count.max(1) as f64)
        .collect()
}

/// Scores that mirrors with nothing hidden, of a family that was not seen, stay below. Effects differ in how well they ape
/// the approximation, so each has its own scale; the common factor makes sure of the best of all of them.
pub(crate) fn thresholds(
    effects: &[(Arc<dyn Effect>, Vec<Direction>)],
    judges: &[Judge],
) -> Vec<f64> {
    let scores: Vec<Vec<f64>> = effects
        .par_iter()
        .map(|(_, directions)| {
            judges
                .iter()
                .flat_map(|judge| judge.scores(directions))
                .collect()
        })
        .collect();
    let scales: Vec<f64> = scores
        .iter()
        .map(|scores| {
            let mut sorted = scores.clone();
            sorted.sort_by(f64::total_cmp);
            quantile(&sorted, QUIET).max(FLOOR)
        })
        .collect();
    let mut worst: Vec<f64> = (0..scores.first().map_or(0, Vec::len))
        .map(|mirror| {
            scores
                .iter()
                .zip(&scales)
                .map(|(scores, scale)| scores[mirror] / scale)
                .fold(0.0, f64::max)
        })
        .collect();
    worst.sort_by(f64::total_cmp);
    let factor = quantile(&worst, QUIET).max(1.0);
    scales
        .iter()
        .map(|scale| ((factor * scale).sqrt() + MARGIN).powi(2))
        .collect()
}

impl Judge {
    /// The misfits of its mirrors.
    pub(crate) fn misfits(&self) -> impl Iterator<Item = f64> {
        self.quiet.iter().map(|v| self.space.product(v, v))
    }

    fn scores(&self, directions: &[Direction]) -> Vec<f64> {
        let directions: Vec<_> = directions
            .iter()
            .map(|direction| direction.seen_in(&self.space))
            .collect();
        self.quiet
            .iter()
            .map(|v| scan(&directions, v, &self.space).map_or(0.0, |e| e.score.max(0.0)))
            .collect()
    }
}

/// The value that this share of sorted values stays below.
pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    sorted[below] + part * (sorted[(below + 1).min(sorted.len() - 1)] - sorted[below])
}
