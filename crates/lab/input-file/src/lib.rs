//! Files that a user names, read up to a stated size.
//!
//! A name may be that of a folder, of a device that never ends, of a pipe that nobody writes to, or of the wrong file, a
//! gigabyte long. Each is an error in words before it costs memory or time.

use std::fs::{self, File, FileType};
use std::io::{self, Read};
#[cfg(unix)]
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use miette::Diagnostic;
use thiserror::Error;

/// A megabyte, in which sizes are told.
pub const MB: u64 = 1_000_000;

/// The most of a file that a person writes, a model or an effect: hundreds of times what one with every effect takes.
pub const MOST_WRITTEN: u64 = MB;

/// The most of a file that is read whole and that an instrument or a program made: a list of points, a sensor's recording
/// (some minutes at 10 kHz, in lines of 16 bytes), a firmware image with all that a debugger needs.
pub const MOST_MADE: u64 = 64 * MB;

/// What some editors and spreadsheets begin a text with, and nobody sees.
pub const BYTE_ORDER_MARK: &str = "\u{feff}";

/// Why a file cannot be read.
#[derive(Debug, Error, Diagnostic)]
pub enum ReadError {
    /// It is not there, or may not be read.
    #[error("'{path}' cannot be read: {source}")]
    #[diagnostic(help("is the name right, and may you read it?"))]
    Unreadable {
        /// The file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// A folder, a device or a pipe.
    #[error("'{path}' is {kind}, and a file is needed")]
    #[diagnostic(help("name a file; what comes out of a pipe or a device can be written to one"))]
    NotAFile {
        /// Its name.
        path: String,
        /// What it is.
        kind: &'static str,
    },
    /// More than is read.
    #[error("'{path}' is larger than {} MB, the most that is read of such a file", *most as f64 / MB as f64)]
    #[diagnostic(help("is it the right file? If so, take out of it what is not needed"))]
    TooLarge {
        /// The file.
        path: String,
        /// The most that is read (bytes).
        most: u64,
    },
    /// Bytes that are no UTF-8.
    #[error("'{path}' is not text: byte {at} is not UTF-8")]
    #[diagnostic(help("is it the right file? If so, save it as plain text in UTF-8"))]
    NotText {
        /// The file.
        path: String,
        /// The first such byte, counted from 0.
        at: usize,
    },
}

/// Opens a file, and nothing but a file.
///
/// # Errors
/// [`ReadError::NotAFile`] and [`ReadError::Unreadable`].
pub fn open(path: &Path) -> Result<File, ReadError> {
    // Before it is opened, which would wait for whoever writes to a pipe.
    let metadata = fs::metadata(path).map_err(|source| unreadable(path, source))?;
    if !metadata.is_file() {
        return Err(ReadError::NotAFile {
            path: path.display().to_string(),
            kind: kind(metadata.file_type()),
        });
    }
    File::open(path).map_err(|source| unreadable(path, source))
}

/// Reads a file of at most so many bytes.
///
/// # Errors
/// Those of [`open`], and [`ReadError::TooLarge`].
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    // What says that it is short may still be long, as files of /proc are.
    open(path)?
        .take(most + 1)
        .read_to_end(&mut bytes)
        .map_err(|source| unreadable(path, source))?;
    if bytes.len() as u64 > most {
        return Err(ReadError::TooLarge {
            path: path.display().to_string(),
            most,
        });
    }
    Ok(bytes)
}

/// Reads a text of at most so many bytes.
///
/// # Errors
/// Those of [`read`], and [`ReadError::NotText`].
pub fn read_text(path: &Path, most: u64) -> Result<String, ReadError> {
    let text = String::from_utf8(read(path, most)?).map_err(|error| ReadError::NotText {
        path: path.display().to_string(),
        at: error.utf8_error().valid_up_to(),
    })?;
    Ok(match text.strip_prefix(BYTE_ORDER_MARK) {
        Some(text) => text.to_owned(),
        None => text,
    })
}

fn unreadable(path: &Path, source: io::Error) -> ReadError {
    ReadError::Unreadable {
        path: path.display().to_string(),
        source,
    }
}

#[cfg(not(unix))]
fn kind(of: FileType) -> &'static str {
    if of.is_dir() { "a folder" } else { "a device" }
}

#[cfg(unix)]
fn kind(of: FileType) -> &'static str {
    if of.is_dir() {
        "a folder"
    } else if of.is_fifo() {
        "a pipe"
    } else if of.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, Mode, mkfifoat};

    #[track_caller]
    fn said(path: &Path) -> String {
        read_text(path, MOST_WRITTEN)
            .expect_err("unreadable")
            .to_string()
    }

    #[test]
    fn what_is_no_file_is_told_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        mkfifoat(CWD, &pipe, Mode::RUSR | Mode::WUSR).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        assert!(said(folder.path()).ends_with("is a folder, and a file is needed"));
        assert!(said(&pipe).ends_with("pipe' is a pipe, and a file is needed"));
        assert!(said(&link).ends_with("link' is a device, and a file is needed"));
        assert!(said(&folder.path().join("none")).contains("none' cannot be read"));
    }

    #[test]
    fn a_file_is_read_up_to_its_limit_and_not_beyond() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.toml");
        fs::write(&path, vec![b' '; MOST_WRITTEN as usize]).unwrap();
        assert_eq!(
            read_text(&path, MOST_WRITTEN).unwrap().len() as u64,
            MOST_WRITTEN
        );
        // A terabyte without a byte on the disk: it must not be read.
        let file = File::options().write(true).open(&path).unwrap();
        for size in [MOST_WRITTEN + 1, 1_000_000 * MB] {
            file.set_len(size).unwrap();
            assert!(
                said(&path).contains("is larger than 1 MB"),
                "{}",
                said(&path)
            );
        }
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        fs::write(&path, "\u{feff}t_s,z_um\n\u{feff}").unwrap();
        assert_eq!(read_text(&path, MOST_MADE).unwrap(), "t_s,z_um\n\u{feff}");
    }

    #[test]
    fn what_is_no_text_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.toml");
        fs::write(&path, b"format\xff").unwrap();
        assert!(said(&path).contains("is not text: byte 6"));
    }
}
