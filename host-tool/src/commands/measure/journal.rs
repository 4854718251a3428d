//! The rows of an experiment on their way into its file, while it is measured.

use measurement::{Keys, Row};

use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::recording::Recording;

/// A file that takes the rows as they come. Once the experiment is over it is replaced by the whole measurement, in which
/// the readings of a sensor of the user's stand as well.
#[derive(Default)]
pub(super) struct Journal {
    file: Option<NewFile>,
    recording: Option<Recording>,
    /// Rows of a sensor whose zero is not known yet.
    waiting: Vec<Row>,
}

impl Journal {
    /// One that writes into `file` as soon as it is begun.
    pub(super) fn new(file: NewFile) -> Self {
        Self {
            file: Some(file),
            ..Self::default()
        }
    }

    /// Begins the file, the first time that it is asked to; the rows have what `like` has.
    pub(super) fn begin(&mut self, keys: &Keys, like: &Row) -> Result<(), ToolError> {
        if let Some(file) = self.file.take() {
            self.recording = Some(Recording::begin(file, keys, like)?);
        }
        Ok(())
    }

    /// Appends a row. Displacements count from `zero_um`; those that come before it is known wait for it.
    pub(super) fn append(&mut self, row: Row, zero_um: Option<f64>) -> Result<(), ToolError> {
        let Some(recording) = &mut self.recording else {
            return Ok(());
        };
        self.waiting.push(row);
        if zero_um.is_none() && row.z_um.is_some() {
            return Ok(());
        }
        for row in self.waiting.drain(..) {
            let z_um = row.z_um.zip(zero_um).map(|(um, zero_um)| um - zero_um);
            recording.append(&Row { z_um, ..row })?;
        }
        Ok(())
    }

    /// The file, where it was begun.
    pub(super) fn into_recording(self) -> Option<Recording> {
        self.recording
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::MeasurementFile;
    use std::fs;

    #[test]
    fn displacements_wait_for_their_zero() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("step.csv");
        let row = |t_s: f64, um: f64| Row {
            t_s,
            z_um: Some(um),
            ..Row::default()
        };
        let mut journal = Journal::new(NewFile::create(path.clone(), false).unwrap());
        journal.begin(&Keys::default(), &row(0.0, 0.0)).unwrap();
        let read = || {
            let text = fs::read_to_string(&path).unwrap();
            let file = MeasurementFile::parse("step.csv", &text).ok()?;
            let z_um: Option<Vec<f64>> = file.rows.iter().map(|row| row.z_um).collect();
            z_um
        };
        journal.append(row(0.0, 31.0), None).unwrap();
        journal.append(row(1.0, 32.0), None).unwrap();
        assert_eq!(read(), None);
        journal.append(row(2.0, 6.0), Some(5.0)).unwrap();
        // Half a second later all of them are in the file.
        assert_eq!(read(), Some(vec![26.0, 27.0, 1.0]));
    }
}
