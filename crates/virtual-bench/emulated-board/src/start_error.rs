//! Why an emulated board does not start.

use std::io;
use std::path::PathBuf;

use board_sockets::Untrusted;

use crate::logs::LogError;
use crate::qemu::QEMU;

/// Why an emulated board does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The image is missing or unreadable.
    #[error("the firmware image {path} cannot be read: {source}")]
    Image {
        /// The image.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The image carries no log table.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The mirror's description has a number out of range.
    #[error(transparent)]
    Mirror(#[from] virtual_mirror::ConfigError),
    /// The shell that becomes QEMU is not there.
    #[error("the emulator cannot be started: {0}")]
    Qemu(io::Error),
    /// QEMU is not there.
    #[error(
        "{QEMU}, the emulator, is not installed; Debian and Ubuntu: `apt-get install {QEMU}`, Fedora: `dnf install {QEMU}`, Arch: \
         `pacman -S {QEMU}`"
    )]
    NoQemu,
    /// No socket can have that name.
    #[error("'{name}' is no name for a board: {reason}")]
    Name {
        /// The name.
        name: String,
        /// Why not.
        reason: String,
    },
    /// The file that was named is no flash, and is left as it is.
    #[error("'{}' cannot be the board's flash: {reason}", path.display())]
    Flash {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// Another board has that name.
    #[error("an emulated board named {0} is already running")]
    NameTaken(String),
    /// QEMU ended or hung before its socket was there.
    #[error("the emulator did not come up: {0}")]
    NotUp(String),
    /// The folder of the boards' sockets.
    #[error(
        "emulated boards are not placed there: {0}; `chmod 700` it, or name another by MIRROR_BOARDS"
    )]
    Folder(#[from] Untrusted),
    /// Directory, FIFO or socket.
    #[error("the emulated board's files cannot be made: {0}")]
    Files(#[from] io::Error),
}
