//! Files about a calibration that the board keeps already: what becomes of them takes nothing back, and is told after the report.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::Builder;

use crate::error::{CalibrationText, OutputError};
use crate::new_file::NewFile;

/// What of the files that were asked for was not written.
pub(super) struct KeptFiles {
    unwritten: Vec<String>,
    calibration: CalibrationText,
    /// Where a calibration goes that its file does not take.
    refuge: PathBuf,
}

impl KeptFiles {
    pub(super) fn new() -> Self {
        Self {
            unwritten: Vec::new(),
            calibration: CalibrationText::AsAsked,
            refuge: std::env::temp_dir(),
        }
    }

    /// Writes a file where it was asked for, and returns its path where that has gone well.
    pub(super) fn write(&mut self, file: Option<NewFile>, text: &str) -> Option<PathBuf> {
        match file?.write(text) {
            Ok(path) => Some(path),
            Err(error) => {
                self.unwritten.push(error.to_string());
                None
            }
        }
    }

    /// The same with the calibration itself. The board does not give it back, so it goes elsewhere where its file does not take it.
    pub(super) fn write_calibration(
        &mut self,
        file: Option<NewFile>,
        text: &str,
    ) -> Option<PathBuf> {
        let is_asked = file.is_some();
        let written = self.write(file, text);
        if is_asked && written.is_none() {
            self.calibration = match saved(&self.refuge, text) {
                Ok(path) => CalibrationText::Elsewhere(path),
                Err(_) => CalibrationText::Nowhere,
            };
        }
        written
    }

    /// # Errors
    /// Where something was not written.
    pub(super) fn ended(self) -> Result<(), OutputError> {
        match self.unwritten.is_empty() {
            true => Ok(()),
            false => Err(OutputError::BesidesKept {
                unwritten: self.unwritten.join("; "),
                calibration: self.calibration,
            }),
        }
    }
}

/// A file of its own in the folder.
fn saved(folder: &Path, text: &str) -> io::Result<PathBuf> {
    let mut named = Builder::new();
    let named = named.prefix("calibration-").suffix(".toml");
    let mut file = named.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    let (_, path) = file.keep().map_err(|error| error.error)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use miette::Diagnostic;

    use super::*;

    /// Files of a folder that is gone once they are to be written, as a full disk is full then.
    fn lost() -> [Option<NewFile>; 2] {
        let folder = tempfile::tempdir().expect("a folder");
        ["c.toml", "t.json"].map(|name| {
            let file = NewFile::create(folder.path().join(name), false);
            Some(file.expect("it can be written"))
        })
    }

    #[test]
    fn a_calibration_that_its_file_does_not_take_is_in_another() {
        let refuge = tempfile::tempdir().expect("a folder");
        let mut files = KeptFiles {
            refuge: refuge.path().to_owned(),
            ..KeptFiles::new()
        };
        let [calibration, trial] = lost();
        assert_eq!(files.write_calibration(calibration, "format = 13"), None);
        assert_eq!(files.write(trial, "{}"), None);
        let error = files.ended().expect_err("two are missing");
        let (said, help) = (error.to_string(), error.help().expect("help").to_string());
        assert!(
            said.starts_with("the board keeps the new calibration, but ")
                && said.contains("c.toml cannot be written")
                && said.contains("t.json cannot be written"),
            "{said}"
        );
        let saved = fs::read_dir(refuge.path()).expect("a folder").next();
        let saved = saved.expect("a file").expect("an entry").path();
        assert_eq!(fs::read_to_string(&saved).expect("text"), "format = 13");
        assert!(help.contains(&*saved.to_string_lossy()), "{help}");
    }

    #[test]
    fn where_nothing_takes_it_that_is_told() {
        let [calibration, _] = lost();
        let mut files = KeptFiles {
            refuge: "/no/such".into(),
            ..KeptFiles::new()
        };
        files.write_calibration(calibration, "format = 13");
        let error = files.ended().expect_err("it is missing");
        let help = error.help().expect("help").to_string();
        assert!(help.contains("calibrate again for a file"), "{help}");
    }

    #[test]
    fn what_was_not_asked_for_is_not_missing() {
        let mut files = KeptFiles::new();
        assert_eq!(files.write_calibration(None, "format = 13"), None);
        assert_eq!(files.write(None, "{}"), None);
        assert!(files.ended().is_ok());
    }
}
