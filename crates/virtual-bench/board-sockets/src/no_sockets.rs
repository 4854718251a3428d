//! A system without the sockets that emulated boards listen on: there are none, and folders are as private as the system's
//! temporary folder is.

use std::fs;
use std::path::Path;

use crate::untrusted::{Untrusted, unseen};

/// All users of this process are one.
pub(crate) fn user() -> u32 {
    0
}

/// Whether what belongs to the user of this number is ours.
pub fn is_ours(owner: u32) -> bool {
    owner == user()
}

/// Makes a folder.
///
/// # Errors
/// Where it cannot be made.
pub fn make_folder(path: &Path) -> Result<(), Untrusted> {
    fs::create_dir_all(path).map_err(|error| unseen(path, error))
}

/// Makes sure that a folder is there.
///
/// # Errors
/// Where it is not.
pub fn check_folder(path: &Path) -> Result<(), Untrusted> {
    fs::read_dir(path)
        .map(drop)
        .map_err(|error| unseen(path, error))
}

/// There is none.
///
/// # Errors
/// Always.
pub fn check_socket(path: &Path) -> Result<(), Untrusted> {
    Err(Untrusted::Kind {
        wanted: "socket",
        path: path.to_owned(),
    })
}

/// Nobody does.
pub fn is_listening(_: &Path) -> bool {
    false
}
