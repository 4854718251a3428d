//! What is found out before anything moves.

use std::fs;
use std::path::Path;

use crate::error::{BeyondBoard, OutputError};
use crate::quantity::Voltage;

/// The directory is there, or is made.
pub(crate) fn make_directory(path: &Path) -> Result<(), OutputError> {
    fs::create_dir_all(path).map_err(|source| OutputError::Write {
        path: path.to_owned(),
        source,
    })
}

/// The drive is one that the board gives, to a rounding.
pub(super) fn check_drive(asked: Voltage, max: Voltage) -> Result<(), BeyondBoard> {
    if (-1e-6..=max.v + 1e-6).contains(&asked.v) {
        Ok(())
    } else {
        Err(BeyondBoard::DriveOutOfRange { asked, max })
    }
}
