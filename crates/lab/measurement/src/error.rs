//! What can be wrong with a measurement file, for people.

use miette::{Diagnostic, NamedSource, SourceSpan};
use std::sync::Arc;
use thiserror::Error;

/// Why a file or a session is not usable. Nothing of it is kept.
#[derive(Debug, Error, Diagnostic)]
pub enum InputError {
    /// The file or folder is not there, or may not be read.
    #[error("'{path}' cannot be read: {source}")]
    Unreadable {
        /// The file or folder.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder, or a list of files, without a measurement.
    #[error("'{path}' holds no measurement files")]
    #[diagnostic(help("measurement files end in .csv"))]
    NoFiles {
        /// The folder.
        path: String,
    },
    /// Files of other surroundings in one session, one of which does not say its own.
    #[error("'{file}' does not say at which temperature it was measured, and '{other}' does")]
    #[diagnostic(help(
        "add the column T_ambient_C to it, the room's in degrees Celsius (`measure --ambient` writes it); files that share a clock need it once"
    ))]
    UnknownAmbient {
        /// The one that does not.
        file: String,
        /// One that does.
        other: String,
    },
    /// Something in a file is wrong.
    #[error("{file}:{line}: {message}")]
    #[diagnostic(help("{help}"))]
    Content {
        /// The file's name.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong, in a sentence.
        message: String,
        /// What to do.
        help: String,
        /// The file's text.
        #[source_code]
        text: Arc<NamedSource<String>>,
        /// Where it is wrong.
        #[label("here")]
        place: SourceSpan,
    },
}

/// What is wrong, and what to do about it.
pub(crate) struct Complaint {
    pub(crate) message: String,
    pub(crate) help: String,
}

impl Complaint {
    pub(crate) fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
        }
    }
}
