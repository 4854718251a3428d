//! Where running emulated boards are found.

use std::env;
use std::path::PathBuf;

/// The directory of the sockets of running emulated boards: `MIRROR_BOARDS` if set, else
/// `mirror-boards` in the user's runtime directory, else in the temporary one.
pub fn boards_directory() -> PathBuf {
    if let Some(directory) = env::var_os("MIRROR_BOARDS") {
        return directory.into();
    }
    env::var_os("XDG_RUNTIME_DIR")
        .map_or_else(env::temp_dir, PathBuf::from)
        .join("mirror-boards")
}
