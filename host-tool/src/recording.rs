//! A measurement file that grows while it is measured, so that what is there outlives this process.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::PathBuf;

use measurement::{Keys, Row, Writer};

use crate::error::OutputError;
use crate::new_file::{GrowingFile, NewFile};

/// What is lost at most when this process is killed (s of the board's time), where samples come as often.
const FLUSH_S: f64 = 0.5;

/// A measurement file that grows.
#[derive(Debug)]
pub(crate) struct Recording {
    file: GrowingFile,
    rows: Rows,
}

impl Recording {
    /// Gives the file its name and its beginning. Its rows may have what `like` has.
    pub(crate) fn begin(file: NewFile, keys: &Keys, like: &Row) -> Result<Self, OutputError> {
        let (file, output) = file.grow()?;
        Self::begin_in(file, output, keys, like)
    }

    fn begin_in(
        file: GrowingFile,
        output: File,
        keys: &Keys,
        like: &Row,
    ) -> Result<Self, OutputError> {
        match Rows::begin(output, keys, like) {
            Ok(rows) => Ok(Self { file, rows }),
            Err(source) => {
                // It holds nothing, and the reason is what is told.
                let _ = file.discard();
                let path = file.name().to_owned();
                Err(OutputError::Write { path, source })
            }
        }
    }

    /// Appends a row, which is in the file by the time a row of half a second later is appended.
    pub(crate) fn append(&mut self, row: &Row) -> Result<(), OutputError> {
        let appended = self.rows.append(row);
        appended.map_err(|source| cut_short(&self.file, self.rows.safe, source))
    }

    /// Makes sure that the file has its name still.
    ///
    /// # Errors
    /// Where somebody has removed or renamed it.
    pub(crate) fn stays(&self) -> Result<(), OutputError> {
        self.file.stays()
    }

    /// Takes the file away.
    pub(crate) fn discard(self) -> Result<(), OutputError> {
        self.file.discard()
    }

    /// Puts a whole file in the place of this one, at its name in the end.
    pub(crate) fn replace(mut self, text: &str) -> Result<PathBuf, OutputError> {
        // Where there is no room for the whole one, this one holds every row.
        if self.rows.writer.flush().is_ok() {
            self.rows.safe = self.rows.writer.rows();
        }
        match self.file.replace(text) {
            Err(OutputError::Write { source, .. }) => {
                Err(cut_short(&self.file, self.rows.safe, source))
            }
            replaced => replaced,
        }
    }

    /// Ends the file, and gives it its name; `partial` says why the measurement is not whole.
    pub(crate) fn finish(self, partial: Option<&str>) -> Result<PathBuf, OutputError> {
        let safe = self.rows.safe;
        match self.rows.finish(partial) {
            Ok(()) => self.file.finish(),
            Err(source) => Err(cut_short(&self.file, safe, source)),
        }
    }
}

/// That a file takes no more; one that is gone holds nothing.
fn cut_short(file: &GrowingFile, rows: usize, source: io::Error) -> OutputError {
    let cut_short = || OutputError::CutShort {
        path: file.name().to_owned(),
        rows,
        source,
    };
    file.stays().err().unwrap_or_else(cut_short)
}

/// Rows on their way into a file, or to the standard output.
#[derive(Debug)]
pub(crate) struct Rows {
    writer: Writer<BufWriter<File>>,
    /// How many the system has taken for certain.
    safe: usize,
    flushed_s: f64,
}

impl Rows {
    pub(crate) fn begin(output: File, keys: &Keys, like: &Row) -> io::Result<Self> {
        let mut writer = Writer::begin(BufWriter::new(output), keys, like)?;
        writer.flush()?;
        Ok(Self {
            writer,
            safe: 0,
            flushed_s: 0.0,
        })
    }

    pub(crate) fn append(&mut self, row: &Row) -> io::Result<()> {
        self.writer.row(row)?;
        if row.t_s - self.flushed_s >= FLUSH_S {
            self.writer.flush()?;
            self.safe = self.writer.rows();
            self.flushed_s = row.t_s;
        }
        Ok(())
    }

    /// Writes the end; `partial` says why they are not all that were asked for.
    pub(crate) fn finish(self, partial: Option<&str>) -> io::Result<()> {
        self.writer.finish(partial)
    }

    /// How many the system has taken for certain.
    pub(crate) fn safe(&self) -> usize {
        self.safe
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::MeasurementFile;
    use std::fs;

    fn row(index: usize) -> Row {
        Row {
            t_s: index as f64 * 0.01,
            ..Row::default()
        }
    }

    #[test]
    fn what_is_recorded_is_in_the_file_before_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        let new = NewFile::create(path.clone(), false).unwrap();
        let mut recording = Recording::begin(new, &Keys::default(), &row(0)).unwrap();
        for index in 0..=120 {
            recording.append(&row(index)).unwrap();
        }
        // As a process leaves it that is killed here: what it holds back is lost.
        std::mem::forget(recording);
        let text = fs::read_to_string(&path).unwrap();
        let file = MeasurementFile::parse("r.csv", &text).unwrap();
        // Up to 1 s, the last flush.
        assert_eq!(file.rows.len(), 101);
        let flaw = file.keys.get("partial").unwrap();
        assert_eq!(flaw, "it was cut short after 101 rows");
    }

    #[test]
    fn a_file_that_is_replaced_is_kept_until_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        fs::write(&path, "old").unwrap();
        let begin = || {
            let new = NewFile::create(path.clone(), true)?;
            Recording::begin(new, &Keys::default(), &row(0))
        };
        let mut recording = begin().unwrap();
        let said = begin().expect_err("what grows is not replaced").to_string();
        assert!(
            said.contains("r.csv.new is being written by another tool"),
            "{said}"
        );
        recording.append(&row(0)).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(recording.finish(None).unwrap(), path);
        assert!(fs::read_to_string(&path).unwrap().ends_with("# rows=1\n"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// A tool that was killed has left it.
    #[test]
    fn a_file_that_nobody_writes_any_more_is_no_obstacle() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        let left = folder.path().join("r.csv.new");
        fs::write(&path, "old").unwrap();
        fs::write(&left, "# left").unwrap();
        let new = NewFile::create(path.clone(), true).unwrap();
        let mut recording = Recording::begin(new, &Keys::default(), &row(0)).unwrap();
        recording.append(&row(0)).unwrap();
        assert_eq!(recording.finish(None).unwrap(), path);
        assert!(fs::read_to_string(&path).unwrap().ends_with("# rows=1\n"));
        assert!(!left.exists());
    }

    #[test]
    fn a_file_that_was_removed_meanwhile_is_told() {
        let folder = tempfile::tempdir().unwrap();
        for replaced in [false, true] {
            let path = folder.path().join("r.csv");
            if replaced {
                fs::write(&path, "old").unwrap();
            }
            let new = NewFile::create(path, replaced).unwrap();
            let mut recording = Recording::begin(new, &Keys::default(), &row(0)).unwrap();
            recording.append(&row(0)).unwrap();
            recording.stays().unwrap();
            fs::remove_file(recording.file.name()).unwrap();
            recording.stays().expect_err("it is gone");
            let said = recording.finish(None).expect_err("it is gone").to_string();
            assert!(said.contains("is gone: something removed"), "{said}");
        }
        assert_eq!(
            fs::read_to_string(folder.path().join("r.csv")).unwrap(),
            "old"
        );
    }

    #[test]
    fn a_folder_that_was_removed_meanwhile_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let new = NewFile::create(folder.path().join("r.csv"), false).unwrap();
        let mut recording = Recording::begin(new, &Keys::default(), &row(0)).unwrap();
        recording.append(&row(0)).unwrap();
        fs::remove_dir_all(folder.path()).unwrap();
        let said = recording.replace("whole").expect_err("it is gone");
        assert!(matches!(said, OutputError::Gone { .. }), "{said}");
    }

    #[test]
    fn a_disk_that_is_full_at_the_beginning_has_no_empty_file_in_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let new = NewFile::create(folder.path().join("r.csv"), false).unwrap();
        let (file, _) = new.grow().unwrap();
        let full = File::options().write(true).open("/dev/full").unwrap();
        let said = Recording::begin_in(file, full, &Keys::default(), &row(0));
        let said = said.expect_err("no room").to_string();
        assert!(
            said.contains("r.csv cannot be written: No space left"),
            "{said}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_full_disk_is_told_with_what_the_file_holds() {
        let folder = tempfile::tempdir().unwrap();
        let new = NewFile::create(folder.path().join("r.csv"), false).unwrap();
        let mut recording = Recording::begin(new, &Keys::default(), &row(0)).unwrap();
        for index in 0..=60 {
            recording.append(&row(index)).unwrap();
        }
        // The rest goes where nothing has room.
        let full = File::options().write(true).open("/dev/full").unwrap();
        recording.rows.writer =
            Writer::begin(BufWriter::new(full), &Keys::default(), &row(0)).unwrap();
        let failed = (61..=200).find_map(|index| recording.append(&row(index)).err());
        let said = failed.expect("no room").to_string();
        assert!(
            said.contains("r.csv cannot be written any further: No space left")
                && said.contains("It holds 51 rows or more"),
            "{said}"
        );
    }
}
