//! Where something is missing, without a list of effects: each quantity of the chain may vary with each driver by a free-form
//! function, and the places are ranked by what that explains.
//!
//! A generalised additive model of one term (T. Hastie and R. Tibshirani, "Generalized Additive Models" (1990)) in the space of
//! residuals: `free_form`. Its thresholds hold the family-wise error rate over all places, as those of effects do.

mod confidence;
mod free_form;
mod place;
mod probe;

pub use confidence::{Sharpness, StageConfidence, shares};
pub use place::{Driver, Place};

pub(crate) use free_form::{Normal, gram};
pub(crate) use probe::{Basis, Reach};

use crate::candidate::Operating;
use crate::null_distribution::{LeftOutFamily, NullDistribution};
use crate::residual_space::{ResidualSpace, Session, Vector};
use mirror_model::Runaway;
use mirror_model::effect::Active;
use probe::Probe;
use serde::Serialize;
use std::sync::Arc;

/// Stages are told until they hold this share of the confidence.
const SURE: f64 = 0.9;

/// A place, and how much a free-form function there explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// The place.
    #[serde(flatten)]
    pub place: Place,
    /// The stage of the chain that it belongs to.
    pub stage: mirror_model::effect::Stage,
    /// How much of the misfit the function explains, less the price of its effective degrees of freedom.
    pub score: f64,
    /// The score that mirrors which lack nothing stay below in 95 of 100 cases, whichever place is tried.
    pub threshold: f64,
}

/// Where something is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Whereabouts {
    /// All stages that have a place, the most likely first.
    pub stages: Vec<StageConfidence>,
    /// The places above their thresholds, best first.
    pub places: Vec<Located>,
}

impl Whereabouts {
    /// The most likely stages that together hold [`SURE`] of the confidence.
    pub fn likely(&self) -> Vec<StageConfidence> {
        let mut held = 0.0;
        let is_needed = |stage: &&StageConfidence| {
            let is_needed = held < SURE;
            held += stage.confidence;
            is_needed
        };
        self.stages.iter().take_while(is_needed).copied().collect()
    }

    /// The best place of each of these stages that has one above its threshold.
    pub fn best_of(&self, stages: &[StageConfidence]) -> Vec<&Located> {
        let best = |stage: &StageConfidence| self.places.iter().find(|p| p.stage == stage.stage);
        stages.iter().filter_map(best).collect()
    }
}

/// A place that was searched.
pub(crate) struct Searched {
    pub(crate) located: Located,
    pub(crate) bases: Vec<Basis>,
    /// For the session's residual.
    pub(crate) session: Normal,
    /// For each mirror of the null ensemble, its family left out.
    pub(crate) null: Vec<Normal>,
}

/// Searches all places, those of time and history unless the readings are settled ones. The best comes first; those with
/// which the model runs away are left out.
pub(crate) fn search(
    at: Operating,
    space: &ResidualSpace<Session>,
    residual: &Vector<Session>,
    families: &[LeftOutFamily],
    null: &NullDistribution,
) -> Result<(Reach, Vec<Searched>), Runaway> {
    let reach = Reach::of(at.model, at.data)?;
    let places = Place::all().filter(|place| !(at.data.is_steady && place.is_of_time()));
    let mut searched = parallel::filter_map(places, |place| {
        let bases = Basis::all(place, &reach);
        let direction = |&basis: &Basis| {
            let probe = Arc::new(Probe::new(place, basis, &reach));
            Some(space.vector(&at.change(&Active::usual(probe)).ok()?))
        };
        let directions = parallel::map(&bases, direction);
        let directions: Vec<_> = directions.into_iter().collect::<Option<_>>()?;
        let session = Normal::of(&directions, residual);
        let null = families.iter().flat_map(|f| f.normals(&directions));
        Some(Searched {
            located: Located {
                place,
                stage: place.stage(),
                score: session.score(),
                threshold: f64::INFINITY,
            },
            null: null.collect(),
            bases,
            session,
        })
    });
    let null_scores: Vec<Vec<f64>> = parallel::map(&searched, |searched| {
        searched.null.iter().map(Normal::score).collect()
    });
    for (searched, threshold) in searched.iter_mut().zip(null.thresholds(&null_scores)) {
        searched.located.threshold = threshold;
    }
    searched.sort_by(|a, b| b.located.score.total_cmp(&a.located.score));
    Ok((reach, searched))
}

/// The stages' confidences, from places with the best first, and the places that are above their thresholds; none if none is.
pub(crate) fn conclude(searched: &[Searched], sharpness: f64) -> Option<Whereabouts> {
    let above = searched.iter().map(|s| &s.located);
    let places: Vec<Located> = above
        .filter(|located| located.score > located.threshold)
        .cloned()
        .collect();
    if places.is_empty() {
        return None;
    }
    let mut best: Vec<&Located> = Vec::new();
    for Searched { located, .. } in searched {
        if best.iter().all(|other| other.stage != located.stage) {
            best.push(located);
        }
    }
    let scores: Vec<f64> = best.iter().map(|located| located.score).collect();
    let stages = best.iter().zip(shares(&scores, sharpness));
    let stages = stages.map(|(located, confidence)| StageConfidence {
        stage: located.stage,
        score: located.score,
        confidence,
    });
    Some(Whereabouts {
        stages: stages.collect(),
        places,
    })
}
