//! Many files of one device and day.

use crate::parse::MOST_ROWS;
use crate::plausibility::Device;
use crate::{InputError, MeasurementFile};
use input_file::{MB, ReadError};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The most of a file (bytes): [`MOST_ROWS`] of every column, as the tool writes them, take 450 MB.
const MOST_OF_A_FILE: u64 = 500 * MB;

/// The files of one session, each with its name: those of one clock together, in the order of its time (by name where there
/// is none), clocks in the order in which they began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Session {
    /// Name and content of each file.
    pub files: Vec<(String, MeasurementFile)>,
}

impl Session {
    /// Reads files, and folders with all the `.csv` files in them that are not hidden.
    ///
    /// # Errors
    /// [`InputError`] for the first file that is not usable, where there is no file at all, where one is there twice, or where one does not say how warm
    /// its surroundings were and another, on another clock, does.
    pub fn load<P: AsRef<Path>>(paths: &[P]) -> Result<Self, InputError> {
        Self::load_of(paths, &Device::default())
    }

    /// The same of a device that something is known of.
    ///
    /// # Errors
    /// As [`load`](Self::load), and for what this device cannot have shown.
    pub fn load_of<P: AsRef<Path>>(paths: &[P], device: &Device) -> Result<Self, InputError> {
        Self::load_up_to(paths, device, MOST_ROWS)
    }

    /// The same with at most so many rows.
    fn load_up_to<P: AsRef<Path>>(
        paths: &[P],
        device: &Device,
        most_rows: usize,
    ) -> Result<Self, InputError> {
        let (mut files, mut room) = (Vec::new(), most_rows);
        let mut places: Vec<(PathBuf, PathBuf)> = Vec::new();
        for path in paths {
            for file in csv_files(path.as_ref())? {
                // One that cannot be found is told when it is read.
                if let Ok(place) = file.canonicalize() {
                    if let Some((_, other)) = places.iter().find(|(known, _)| *known == place) {
                        let [path, other] = [&file, other].map(|path| path.display().to_string());
                        return Err(InputError::Twice { path, other });
                    }
                    places.push((place, file.clone()));
                }
                let (name, read) = (file.display().to_string(), read(&file, device, room)?);
                room -= read.rows.len();
                files.push((name, read));
            }
        }
        if files.is_empty() {
            return Err(InputError::NoFiles {
                path: "the list of files".into(),
            });
        }
        let start = |file: &MeasurementFile| {
            file.rows
                .first()
                .and_then(|row| row.t_global_s)
                .unwrap_or(f64::INFINITY)
        };
        files.sort_by(|(_, a), (_, b)| {
            let timed_first = a.keys.is_steady().cmp(&b.keys.is_steady());
            let by_clock = a.keys.session().cmp(&b.keys.session());
            let by_start = start(a).total_cmp(&start(b));
            timed_first.then(by_clock).then(by_start)
        });
        let session = Self { files };
        session.check_ambients()?;
        Ok(session)
    }
}

impl Session {
    /// The first known temperature of a file's surroundings, its own or that of a file on the same clock (degC).
    pub fn ambient_c(&self, file: &MeasurementFile) -> Option<f64> {
        file.ambient_c().or_else(|| {
            let others = self
                .files
                .iter()
                .filter(|(_, other)| file.shares_clock(other));
            others
                .map(|(_, other)| other)
                .find_map(MeasurementFile::ambient_c)
        })
    }

    /// A sentence for each file that is not whole: one that was cut short while it was written, or whose measurement ended
    /// early; and for each that holds what another one does.
    pub fn flaws(&self) -> Vec<String> {
        let flaw = |(name, file): &(String, MeasurementFile)| {
            let why = file.keys.get("partial")?;
            Some(format!(
                "'{name}' is not whole, and is read for what it has: {why}"
            ))
        };
        let flaws = self.files.iter().filter_map(flaw);
        flaws.chain(self.copies()).collect()
    }

    fn copies(&self) -> impl Iterator<Item = String> {
        let copy = |(index, (name, file)): (usize, &(String, MeasurementFile))| {
            let (other, _) = self.files[..index]
                .iter()
                .find(|(_, other)| other == file)?;
            Some(format!(
                "'{name}' holds exactly what '{other}' does, and counts beside it: if it is a copy, remove it"
            ))
        };
        self.files.iter().enumerate().filter_map(copy)
    }

    fn check_ambients(&self) -> Result<(), InputError> {
        let says = |(_, file): &&(String, MeasurementFile)| file.ambient_c().is_some();
        let Some((other, _)) = self.files.iter().find(says) else {
            return Ok(());
        };
        match self
            .files
            .iter()
            .find(|(_, file)| self.ambient_c(file).is_none())
        {
            None => Ok(()),
            Some((file, _)) => Err(InputError::UnknownAmbient {
                file: file.clone(),
                other: other.clone(),
            }),
        }
    }
}

/// Reads a file of at most so many rows.
fn read(path: &Path, device: &Device, most_rows: usize) -> Result<MeasurementFile, InputError> {
    let (name, file) = (path.display().to_string(), input_file::open(path)?);
    let size = file.metadata().map_or(0, |metadata| metadata.len());
    if size > MOST_OF_A_FILE {
        return Err(InputError::TooLarge {
            path: name,
            size_mb: size as f64 / MB as f64,
            most_mb: MOST_OF_A_FILE as f64 / MB as f64,
        });
    }
    let source = Told::new(file, &name, size);
    MeasurementFile::read(&name, BufReader::new(source), device, most_rows)
}

/// A file that tells through the `log` facade how much of it has been read, where it is large.
struct Told<'a> {
    file: File,
    name: &'a str,
    size: u64,
    read: u64,
}

impl<'a> Told<'a> {
    /// Each time that so much more has been read (bytes).
    const STEP: u64 = 5 * MB;

    fn new(file: File, name: &'a str, size: u64) -> Self {
        Self {
            file,
            name,
            size,
            read: 0,
        }
    }
}

impl Read for Told<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let arrived = self.file.read(buffer)?;
        let before = self.read;
        self.read += arrived as u64;
        if before / Self::STEP != self.read / Self::STEP {
            let (read, size) = (self.read / MB, self.size / MB);
            log::info!("{read} of {size} MB of `{}` read", self.name);
        }
        Ok(arrived)
    }
}

impl Seek for Told<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

fn csv_files(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let unreadable = |source| ReadError::Unreadable {
        path: path.display().to_string(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        if is_measurement(&file) {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Err(InputError::NoFiles {
            path: path.display().to_string(),
        });
    }
    files.sort();
    Ok(files)
}

/// Whether a file of a folder is a measurement by its name. Hidden ones are a system's or an editor's.
fn is_measurement(file: &Path) -> bool {
    let is_csv = file
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let name = file.file_name().unwrap_or_default();
    is_csv && !name.as_encoded_bytes().starts_with(b".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_does_not_count_twice() {
        let folder = tempfile::tempdir().unwrap();
        let [file, other] = ["a.csv", "b.csv"].map(|name| folder.path().join(name));
        for file in [&file, &other] {
            std::fs::write(file, "t_s,V_V\n1,0\n2,0\n").unwrap();
        }
        assert_eq!(Session::load(&[&file, &other]).unwrap().files.len(), 2);
        let winding = folder.path().join(".").join("a.csv");
        for twice in [
            [&file, &file],
            [&file, &winding],
            [&folder.path().to_owned(), &file],
        ] {
            let said = Session::load(&twice).unwrap_err().to_string();
            assert!(said.contains("is there twice"), "{said}");
        }
    }

    #[test]
    fn a_copy_of_a_file_is_told() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("a (copy).csv", "t_s,V_V\n1,0\n2,1\n"),
            ("a.csv", "t_s,V_V\n1,0\n2,1\n"),
            ("b.csv", "t_s,V_V\n1,0\n2,2\n"),
        ] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let session = Session::load(&[folder.path()]).unwrap();
        assert_eq!(session.files.len(), 3);
        let [told] = &session.flaws()[..] else {
            panic!("{:?}", session.flaws());
        };
        assert!(
            told.contains("a.csv' holds exactly what") && told.contains("a (copy).csv' does"),
            "{told}"
        );
    }

    #[test]
    fn a_folder_is_read_for_its_measurements_in_any_case_and_not_for_hidden_files() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv", "b.CSV", "c.Csv"] {
            std::fs::write(folder.path().join(name), "t_s,V_V\n1,0\n2,0\n").unwrap();
        }
        for name in ["._a.csv", ".csv", "notes.txt"] {
            std::fs::write(folder.path().join(name), "Mac OS X").unwrap();
        }
        let session = Session::load(&[folder.path()]).unwrap();
        assert_eq!(session.files.len(), 3);
    }

    #[test]
    fn files_share_the_limit_of_rows() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv", "b.csv"] {
            let text = "t_s,V_V\n1,0\n2,0\n3,0\n";
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let load = |most| Session::load_up_to(&[folder.path()], &Device::default(), most);
        assert_eq!(load(6).unwrap().files.len(), 2);
        let said = load(5).unwrap_err().to_string();
        assert!(
            said.contains("b.csv:4: with this row the session has more than"),
            "{said}"
        );
    }
}
