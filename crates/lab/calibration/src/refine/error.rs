//! Why a calibration was not refined.

use control_core::CalibrationError;

/// Why nothing was refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// Too few readings.
    #[error(
        "{0} readings of displacement under a known heating are too few to refine a calibration; record the currents, measure steps, read densely"
    )]
    TooFew(usize),
    /// Nothing follows the readings.
    #[error(
        "no stages follow what was measured; look whether the sensor sees the mirror, whether its readings have spikes or are \
         noisier than 0.1 um, and whether currents were recorded"
    )]
    NoFit,
    /// The bent table is none.
    #[error("the refined calibration cannot be used: {0}")]
    Calibration(#[from] CalibrationError),
}
