//! Many files of one device and day.

use crate::plausibility::Device;
use crate::{InputError, MeasurementFile};
use std::path::{Path, PathBuf};

/// The files of one session, each with its name, in the order of their global time (by name where there is none).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Session {
    /// Name and content of each file.
    pub files: Vec<(String, MeasurementFile)>,
}

impl Session {
    /// Reads files, and folders with all the `.csv` files in them.
    ///
    /// # Errors
    /// [`InputError`] for the first file that is not usable, or where there is no file at all.
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
        files.sort_by(|(_, a), (_, b)| start(a).total_cmp(&start(b)));
        Ok(Self { files })
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
