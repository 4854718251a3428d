//! Calibration files that a user names.

use std::path::Path;

use control_core::Calibration;
use mirror_protocol::CalibrationInfo;

use crate::board::Board;
use crate::error::{ToolError, UnusableInput};

/// The calibration in a file.
///
/// # Errors
/// Where it cannot be read.
pub(super) fn load(file: &Path) -> Result<Calibration, ToolError> {
    let text = input_file::read_text(file, input_file::MOST_WRITTEN)?;
    Ok(calibration::from_toml(&file.display().to_string(), &text)?)
}

/// The calibration in a file, which the board uses.
///
/// # Errors
/// Where it cannot be read, or the board uses another.
pub(super) async fn load_in_use(board: &Board, file: &Path) -> Result<Calibration, ToolError> {
    let calibration = load(file)?;
    match says(&board.calibration().await?, &calibration) {
        true => Ok(calibration),
        false => Err(UnusableInput::OtherCalibration {
            file: file.to_owned(),
        }
        .into()),
    }
}

/// Whether what a board says of its calibration is so of this one.
fn says(info: &CalibrationInfo, calibration: &Calibration) -> bool {
    let origin = &calibration.parts().origin;
    info.model_hash == origin.model_hash
        && info.device.as_str() == origin.device.as_str()
        && info.date.as_str() == origin.date.as_str()
}
