//! Where running emulated boards are found, and whether what is there may be trusted.

#[cfg(unix)]
mod listening;
#[cfg(not(unix))]
mod no_sockets;
#[cfg(unix)]
mod trust;
mod untrusted;

use std::env;
use std::path::{Path, PathBuf};

#[cfg(unix)]
pub use listening::is_listening;
#[cfg(not(unix))]
use no_sockets as trust;
#[cfg(not(unix))]
pub use no_sockets::is_listening;
pub use trust::{check_folder, check_socket, is_ours, make_folder};
pub use untrusted::Untrusted;

/// The folder of the sockets of running emulated boards: `MIRROR_BOARDS` if set, else
/// `mirror-boards` in the user's runtime directory, else one of the user's own in the temporary one,
/// which all users share.
pub fn boards_directory() -> PathBuf {
    if let Some(directory) = env::var_os("MIRROR_BOARDS") {
        return directory.into();
    }
    match env::var_os("XDG_RUNTIME_DIR") {
        Some(directory) => PathBuf::from(directory).join("mirror-boards"),
        None => env::temp_dir().join(format!("mirror-boards-{}", trust::user())),
    }
}

/// The FIFOs by which an emulated board is stopped whoever holds its socket: each byte that is written into the first
/// is a stop, and comes out of the second once it is carried out.
pub fn stop_fifos(socket: &Path) -> [PathBuf; 2] {
    ["stop.in", "stop.out"].map(|ending| socket.with_extension(ending))
}
