//! Whether a socket has somebody behind it.

use std::path::Path;

use rustix::io::{Errno, FdFlags, fcntl_setfd, ioctl_fionbio};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType, connect, socket};

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
