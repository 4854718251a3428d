//! Why what is found is passed over.

use std::io;
use std::path::{Path, PathBuf};

/// Why a socket, or the folder that it is in, is not trusted.
#[derive(Debug, thiserror::Error)]
pub enum Untrusted {
    /// It could lead anywhere.
    #[error("{} is a symbolic link", .0.display())]
    Link(PathBuf),
    /// It is something else.
    #[error("{} is no {wanted}", path.display())]
    Kind {
        /// What it should be.
        wanted: &'static str,
        /// Where.
        path: PathBuf,
    },
    /// It belongs to another user.
    #[error("{} belongs to another user, number {owner}", path.display())]
    Foreign {
        /// Whose it is.
        owner: u32,
        /// Where.
        path: PathBuf,
    },
    /// Other users may write to it.
    #[error("other users may write to {} (mode {mode:03o})", path.display())]
    Writable {
        /// Its mode.
        mode: u32,
        /// Where.
        path: PathBuf,
    },
    /// The system does not tell.
    #[error("{}: {error}", path.display())]
    Unseen {
        /// What it said.
        error: io::Error,
        /// Where.
        path: PathBuf,
    },
}

pub(crate) fn unseen(path: &Path, error: io::Error) -> Untrusted {
    Untrusted::Unseen {
        error,
        path: path.to_owned(),
    }
}
