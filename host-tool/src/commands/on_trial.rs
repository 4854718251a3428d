//! A calibration that is on trial where nothing tries it: a tool that was killed has left it.

use mirror_protocol::Kept;

use super::status::calibrated_words;
use crate::board::Board;
use crate::error::ToolError;
use crate::verbosity::say;

/// Says so where positions go by such a calibration.
///
/// # Errors
/// Where the board does not answer.
pub(super) async fn warn(board: &Board) -> Result<(), ToolError> {
    let calibration = board.calibration().await?;
    if calibration.kept == Kept::OnTrial {
        say(format_args!(
            "the board goes by a calibration that a tool left: {}",
            calibrated_words(&calibration)
        ));
    }
    Ok(())
}
