//! `load-calibration`: a calibration that `calibrate -o` wrote, on the board again, or on another.

use std::fmt;
use std::path::Path;

use mirror_protocol::CalibrationUse;
use serde::Serialize;

use super::calibration_file;
use crate::board::Board;
use crate::commands::calibrate_sense;
use crate::commands::interrupt::Interrupt;
use crate::commands::status::calibrated_words;
use crate::error::ToolError;
use crate::report::{self, decimal};

#[derive(Serialize)]
struct LoadedCalibration {
    calibration: String,
    /// The one that the board had.
    before: String,
    max_position_um: f64,
}

/// Reads the file before it asks anything of the board, which keeps what it has unless it takes the new one.
pub(super) async fn run(board: &Board, file: &Path, json: bool) -> Result<(), ToolError> {
    let calibration = calibration_file::load(file)?;
    let before = board.calibration().await?;
    // What comes after is short, and done whole.
    Interrupt::listen()?
        .or(calibrate_sense::zero_once(board))
        .await?;
    let loaded = board
        .use_calibration(&calibration, CalibrationUse::ForGood)
        .await?;
    let max_position_um = decimal(board.status().await?.max_position_um);
    let report = LoadedCalibration {
        calibration: calibrated_words(&loaded),
        before: calibrated_words(&before),
        max_position_um,
    };
    report::print(&report, json);
    Ok(())
}

impl fmt::Display for LoadedCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "calibrated {}", self.calibration)?;
        writeln!(f, "before     {}", self.before)?;
        writeln!(f, "range      0 to {:.1} um", self.max_position_um)
    }
}
