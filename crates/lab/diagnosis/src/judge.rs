//! Mirrors with nothing hidden as judges: each family in the space that the other families span, as if a user's mirror came
//! from a family that nobody has seen.

use crate::candidate::{Direction, scan};
use crate::family::CALIBRATING;
use crate::space::{Approximation, Space, Vector};
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
const FLOOR: f64 = 25.0;
/// What an effect leaves, beyond what its form may, must be no more than so many of these mirrors leave: the space that judges
/// them knows a family less than the session's.
const ORDINARY: f64 = 0.9;
/// An effect that is named may leave unexplained, beyond what nothing hidden leaves, this share of what it explains: nature's
/// form is not quite the candidate's.
const FORM: f64 = 0.3;

/// Mirrors of one family in the space that the other families span.
pub(crate) struct Judge {
    space: Space,
    quiet: Vec<Vector>,
}

/// One judge a family. `slopes` and `white` are the base's directions and the white noise, in units of trust.
pub(crate) fn judges(
    slopes: &DMatrix<f64>,
    approximation: &Arc<Approximation>,
    white: &DVector<f64>,
) -> Vec<Judge> {
    let families = CALIBRATING.len();
    let noises: Vec<Vector> = (0..approximation.mirrors() / families)
        .into_par_iter()
        .map(|turn| {
            let mut rng = ChaCha8Rng::seed_from_u64(turn as u64);
            approximation.vector(&white.map(|sigma| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                sigma * normal
            }))
        })
        .collect();
    (0..families)
        .into_par_iter()
        .map(|family| {
            let (judging, spanning): (Vec<_>, Vec<_>) =
                (0..approximation.mirrors()).partition(|mirror| mirror % families == family);
            let space = Space::new(slopes, approximation, spanning);
            let quiet = judging
                .iter()
                .zip(&noises)
                .map(|(&mirror, noise)| space.of(&approximation.mirror(mirror) + noise))
                .collect();
            Judge { space, quiet }
        })
        .collect()
}

/// What mirrors with nothing hidden, each of a family that was not seen, show.
pub(crate) struct Calm {
    /// Their misfits, in order.
    misfits: Vec<f64>,
    /// The score of each effect that they stay below.
    pub(crate) thresholds: Vec<f64>,
}

impl Calm {
    pub(crate) fn new(effects: &[(Arc<dyn Effect>, Vec<Direction>)], judges: &[Judge]) -> Self {
        let misfits: Vec<f64> = judges.iter().flat_map(Judge::misfits).collect();
        let mut sorted = misfits.clone();
        sorted.sort_by(f64::total_cmp);
        let mut calm = Self {
            misfits: sorted,
            thresholds: Vec::new(),
        };
        calm.thresholds = thresholds(effects, judges, &misfits, &calm);
        calm
    }

    /// The misfit that this share of the mirrors stay below.
    pub(crate) fn misfit(&self, share: f64) -> f64 {
        quantile(&self.misfits, share)
    }

    /// Whether a misfit is more than mirrors with nothing hidden show, and more than a few readings could.
    pub(crate) fn is_exceeded_by(&self, misfit: f64) -> bool {
        misfit > self.misfit(QUIET).max(self.misfit(0.5) + FLOOR)
    }

    /// Whether effects that lower a misfit by `score` leave no more than what nothing hidden leaves, and what their forms
    /// may be off by.
    pub(crate) fn explains(&self, misfit: f64, score: f64) -> bool {
        unexplained(misfit, score) <= self.misfit(ORDINARY)
    }
}

/// What is left of a misfit that effects lower by `score`, and that their forms may not be to blame for.
fn unexplained(misfit: f64, score: f64) -> f64 {
    misfit - (1.0 + FORM) * score
}

/// Scores that mirrors with nothing hidden, of a family that was not seen, stay below. Only scores that would be believed
/// count. Effects differ in how well they ape the approximation, so each has its own scale; the common factor makes sure of
/// the best of all of them.
fn thresholds(
    effects: &[(Arc<dyn Effect>, Vec<Direction>)],
    judges: &[Judge],
    misfits: &[f64],
    calm: &Calm,
) -> Vec<f64> {
    let scores: Vec<Vec<f64>> = effects
        .par_iter()
        .map(|(_, directions)| {
            let scores = judges.iter().flat_map(|judge| judge.scores(directions));
            scores
                .zip(misfits)
                .map(|(score, &misfit)| {
                    if calm.is_exceeded_by(unexplained(misfit, score)) {
                        0.0
                    } else {
                        score
                    }
                })
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
