//! Experiments that a board cannot play.

use experiment_player::PlayError;

use super::ToolError;
use crate::quantity::{Frequency, Span};

impl From<PlayError> for ToolError {
    fn from(error: PlayError) -> Self {
        let hz = |hz| Frequency { hz };
        let seconds = |s| Span { s };
        match error {
            PlayError::TooManyPoints { count, most } => Self::TooManyPoints { count, most },
            PlayError::Dwell { asked_s, tick_s } => Self::Dwell {
                asked: seconds(asked_s),
                tick: seconds(tick_s),
            },
            PlayError::Rate {
                asked_hz,
                highest_hz,
            } => Self::Rate {
                asked: hz(asked_hz),
                highest: hz(highest_hz),
            },
            PlayError::Frequency {
                asked_hz,
                highest_hz,
            } => Self::Frequency {
                asked: hz(asked_hz),
                highest: hz(highest_hz),
            },
            PlayError::Tilts => Self::Defect {
                what: "tilts beside another signal",
            },
            PlayError::Stage => Self::Defect {
                what: "moving a stage",
            },
        }
    }
}
