//! Where running emulated boards are found, and whether what is there may be trusted.

mod trust;

use std::env;
use std::path::{Path, PathBuf};

use rustix::io::{Errno, FdFlags, fcntl_setfd, ioctl_fionbio};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType, connect, socket};

pub use trust::{Untrusted, check_folder, check_socket, is_ours, make_folder};

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

/// Whether somebody listens on the socket at `path`, be it that they are busy with somebody else.
///
/// It never waits: an emulator that has a tool connected takes no second one, and a connection to
/// it would hang until the first has gone.
pub fn is_listening(path: &Path) -> bool {
    let probe = || {
        let address = SocketAddrUnix::new(path)?;
        let socket = socket(AddressFamily::UNIX, SocketType::STREAM, None)?;
        fcntl_setfd(&socket, FdFlags::CLOEXEC)?;
        ioctl_fionbio(&socket, true)?;
        connect(&socket, &address)
    };
    matches!(probe(), Ok(()) | Err(Errno::AGAIN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn tells_sockets_in_use_from_those_left_behind() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.sock");
        assert!(!is_listening(&path));
        let listener = UnixListener::bind(&path).expect("a socket");
        // Nobody accepts, so the queue fills up; it is still somebody's.
        assert!((0..1000).all(|_| is_listening(&path)));
        drop(listener);
        assert!(!is_listening(&path), "the file alone is nobody");
    }
}
