//! What is found out before anything moves.

use std::fs;
use std::path::Path;

use quantities::Voltage;

use crate::error::{BeyondBoard, OutputError};

/// The directory is there, or is made.
pub(crate) fn make_directory(path: &Path) -> Result<(), OutputError> {
    if path.exists() && !path.is_dir() {
        return Err(OutputError::NotAFolder {
            path: path.to_owned(),
        });
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_no_folder_and_what_is_not_there_is_made() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("one/session");
        make_directory(&session).expect("made");
        make_directory(&session).expect("there already");
        let file = session.join("a.csv");
        fs::write(&file, "").expect("ours");
        let said = make_directory(&file).expect_err("a file").to_string();
        assert!(
            said.ends_with("a.csv is there and is not a folder"),
            "{said}"
        );
    }
}
