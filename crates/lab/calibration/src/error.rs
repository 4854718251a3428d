//! Why a model gives no calibration.

use control_core::CalibrationError;
use control_core::calibration::Label;
use mirror_model::Runaway;

/// Why a model gives no calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TabulateError {
    /// Simulating it at rest ends nowhere.
    #[error(transparent)]
    Runaway(#[from] Runaway),
    /// More drive does not mean more displacement.
    #[error(
        "the model cannot be inverted: from {from_v:.3} to {to_v:.3} V its displacement does not rise"
    )]
    NotRising {
        /// The lower drive.
        from_v: f64,
        /// The higher drive.
        to_v: f64,
    },
    /// The numbers are beyond what a board takes.
    #[error("the model gives no calibration: {0}")]
    Calibration(#[from] CalibrationError),
    /// The name of device or date is too long, or has a control character.
    #[error("'{0}' is too long for a calibration, which holds {max} bytes of it, or has a control character", max = Label::CAPACITY)]
    Label(String),
}
