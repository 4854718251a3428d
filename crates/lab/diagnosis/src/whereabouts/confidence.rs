//! How sure it is where something is missing: a softmax over the stages of the chain, its temperature learned from virtual
//! mirrors in which it is known (temperature scaling: C. Guo et al., "On Calibration of Modern Neural Networks", ICML 2017).

use crate::confusions::Channels;
use mirror_model::effect::Stage;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::LazyLock;

/// The table: what a standard deviation of amplitude counts for, the inverse of the temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sharpness {
    /// Where displacement and currents were measured.
    pub both: f64,
    /// Where only the displacement was.
    pub displacement: f64,
    /// Where only currents were.
    pub currents: f64,
}

impl Sharpness {
    /// The table that ships.
    pub(crate) fn shipped() -> Self {
        static TABLE: LazyLock<Sharpness> = LazyLock::new(|| {
            toml::from_str(include_str!("confidence.toml")).expect("the table that ships is tested")
        });
        *TABLE
    }

    pub(crate) fn with(self, channels: Channels) -> f64 {
        match channels {
            Channels::Both => self.both,
            Channels::Displacement => self.displacement,
            Channels::Currents => self.currents,
        }
    }
}

/// A stage of the chain, and how likely it is that what is missing belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageConfidence {
    /// The stage.
    pub stage: Stage,
    /// The score of its best place.
    pub score: f64,
    /// The share of cases like this in which it is this stage; those of all stages add up to 1.
    pub confidence: f64,
}

impl fmt::Display for StageConfidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:.0} %", self.stage, 100.0 * self.confidence)
    }
}

/// The softmax of the scores' roots times the sharpness. A root is an amplitude in standard deviations.
pub fn shares(scores: &[f64], sharpness: f64) -> Vec<f64> {
    let amplitudes: Vec<f64> = scores.iter().map(|score| score.max(0.0).sqrt()).collect();
    let most = amplitudes.iter().copied().fold(0.0, f64::max);
    let weights = amplitudes.iter().map(|a| (sharpness * (a - most)).exp());
    let weights: Vec<f64> = weights.collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_one_and_are_sharper_the_more_sharpness() {
        // Amplitudes 10, 6 and 6: the others weigh exp(-0.25 * 4) of the first.
        let scores = [100.0, 36.0, 36.0];
        assert_eq!(shares(&scores, 0.0), [1.0 / 3.0; 3]);
        let first = 1.0 / (1.0 + 2.0 * (-1.0_f64).exp());
        assert!((shares(&scores, 0.25)[0] - first).abs() < 1e-12);
        let sum: f64 = shares(&scores, 0.25).iter().sum();
        assert!((sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_table_that_ships_can_be_read() {
        let table = Sharpness::shipped();
        for channels in [Channels::Both, Channels::Displacement, Channels::Currents] {
            assert!(table.with(channels) > 0.0);
        }
    }
}
