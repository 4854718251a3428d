//! Who has a board: what a tool writes into the file beside the board's socket that it locks.

use std::ffi::OsString;
use std::fmt;
use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek};
use std::path::PathBuf;

use board_sockets::{boards_directory, make_folder};
use chrono::{SecondsFormat, Utc};
use serde::{Deserialize, Serialize};

use super::find::{Found, Place};
use crate::system::private_file;

/// A command line is told so far: it must fit a line of a terminal, with the rest of the sentence.
const COMMAND_CHARACTERS: usize = 60;
/// Longer files are nobody's: four times what a command line, escaped, can make of it.
pub(super) const FILE_BYTES: u64 = 4096;

/// A process that has a board.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    /// Its id.
    pub process: u32,
    /// Its command line, as far as it fits a line.
    pub command: String,
    /// Since when, in UTC: `2026-11-21T14:05:00Z`.
    pub since: String,
}

impl Owner {
    pub(super) fn this_process() -> Self {
        Self {
            process: std::process::id(),
            command: command_line(std::env::args_os()),
            since: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
        }
    }
}

impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            process,
            command,
            since,
        } = self;
        write!(f, "`{command}` (process {process}), since {since}")
    }
}

/// The program without its folder, and its arguments.
fn command_line(mut words: impl Iterator<Item = OsString>) -> String {
    let program = PathBuf::from(words.next().unwrap_or_default());
    let program = program.file_name().map(OsString::from);
    let line: Vec<OsString> = program.into_iter().chain(words).collect();
    printable(&line.join(" ".as_ref()).to_string_lossy())
}

/// What can be shown on a terminal, so far as it fits a line.
fn printable(text: &str) -> String {
    let shown = text.chars().filter(|character| !character.is_control());
    shown.take(COMMAND_CHARACTERS).collect()
}

/// Who has the board at this moment, if it is somebody who says so.
pub fn owner(found: &Found) -> Option<Owner> {
    let mut file = private_file().write(false).open(place(found)?).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => read(&mut file),
        _ => None,
    }
}

/// The file that is locked, in a directory that is there.
pub(super) fn place(found: &Found) -> Option<PathBuf> {
    match &found.place {
        Place::Socket { path } => Some(fs::canonicalize(path).ok()?.with_extension("lock")),
        Place::Usb { serial } => {
            let directory = boards_directory();
            make_folder(&directory).ok()?;
            Some(directory.join(format!("{serial}.lock")))
        }
    }
}

/// Where who has the board answers those who look at it.
pub(super) fn look_socket(found: &Found) -> Option<PathBuf> {
    Some(place(found)?.with_extension("look"))
}

pub(super) fn read(file: &mut File) -> Option<Owner> {
    let mut text = String::new();
    file.rewind().ok()?;
    file.take(FILE_BYTES).read_to_string(&mut text).ok()?;
    let owner: Owner = serde_json::from_str(&text).ok()?;
    Some(Owner {
        command: printable(&owner.command),
        since: printable(&owner.since),
        ..owner
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_is_told_as_it_was_typed_so_far_as_it_fits() {
        let words = |line: &str| command_line(line.split(' ').map(OsString::from));
        assert_eq!(words("/usr/bin/host-tool"), "host-tool");
        assert_eq!(words("./a/host-tool set-z 1um"), "host-tool set-z 1um");
        let long = words(&format!("host-tool record -o {}", "x".repeat(1000)));
        assert_eq!(long.chars().count(), COMMAND_CHARACTERS);
    }
}
