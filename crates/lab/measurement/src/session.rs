//! Many files of one device and day.

use crate::plausibility::Device;
use crate::{InputError, MeasurementFile};
use std::path::{Path, PathBuf};

/// The files of one session, each with its name: those of one clock together, in the order of its time (by name where there
/// is none), clocks in the order in which they began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Session {
    /// Name and content of each file.
    pub files: Vec<(String, MeasurementFile)>,
}

impl Session {
    /// Reads files, and folders with all the `.csv` files in them.
    ///
    /// # Errors
    /// [`InputError`] for the first file that is not usable, where there is no file at all, or where one does not say how warm
    /// its surroundings were and another, on another clock, does.
    pub fn load<P: AsRef<Path>>(paths: &[P]) -> Result<Self, InputError> {
        Self::load_of(paths, &Device::default())
    }

    /// The same of a device that something is known of.
    ///
    /// # Errors
    /// As [`load`](Self::load), and for what this device cannot have shown.
    pub fn load_of<P: AsRef<Path>>(paths: &[P], device: &Device) -> Result<Self, InputError> {
        let mut files = Vec::new();
        for path in paths {
            for file in csv_files(path.as_ref())? {
                let name = file.display().to_string();
                let text =
                    std::fs::read_to_string(&file).map_err(|source| InputError::Unreadable {
                        path: name.clone(),
                        source,
                    })?;
                files.push((
                    name.clone(),
                    MeasurementFile::parse_of(&name, &text, device)?,
                ));
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
            let by_clock = a.keys.session().cmp(&b.keys.session());
            by_clock.then(start(a).total_cmp(&start(b)))
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

fn csv_files(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let unreadable = |source| InputError::Unreadable {
        path: path.display().to_string(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        if file.extension().is_some_and(|extension| extension == "csv") {
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
