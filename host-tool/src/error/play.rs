//! Experiments that a board cannot play.

use experiment_player::PlayError;
use quantities::{Frequency, Span};

use super::{BeyondBoard, ToolError};

impl From<PlayError> for ToolError {
    fn from(error: PlayError) -> Self {
        let hz = |hz| Frequency { hz };
        let seconds = |s| Span { s };
        let beyond = match error {
            PlayError::TooManyPoints { count, most } => BeyondBoard::TooManyPoints { count, most },
            PlayError::Dwell { asked_s, tick_s } => BeyondBoard::Dwell {
                asked: seconds(asked_s),
                tick: seconds(tick_s),
            },
            PlayError::Rate {
                asked_hz,
                highest_hz,
            } => BeyondBoard::Rate {
                asked: hz(asked_hz),
                highest: hz(highest_hz),
            },
            PlayError::Frequency {
                asked_hz,
                highest_hz,
            } => BeyondBoard::Frequency {
                asked: hz(asked_hz),
                highest: hz(highest_hz),
            },
            PlayError::Tilts => {
                return Self::Defect {
                    what: "tilts beside another signal",
                };
            }
            PlayError::Stage => {
                return Self::Defect {
                    what: "moving a stage",
                };
            }
        };
        beyond.into()
    }
}
