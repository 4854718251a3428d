//! Why a model could not be loaded.

use crate::Preset;
use input_file::ReadError;
use miette::{Diagnostic, NamedSource, SourceSpan};
use std::sync::Arc;
use thiserror::Error;

/// The version of the format that this crate reads and writes.
pub(super) const FORMAT: u32 = 1;

/// Why a model could not be loaded.
#[derive(Debug, Error, Diagnostic)]
pub enum ModelFileError {
    /// It is neither a preset nor a file.
    #[error("there is no model called '{name}'")]
    #[diagnostic(help("use a preset ({}) or the path of a model file", preset_names()))]
    NotFound {
        /// What was asked for.
        name: String,
    },
    /// The file is there but cannot be read, or is too large for a model.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] ReadError),
    /// The file says something that no model can have.
    #[error("{message}")]
    #[diagnostic(help("{help}"))]
    Content {
        /// What is wrong.
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

pub(super) fn preset_names() -> String {
    Preset::ALL.map(Preset::name).join(", ")
}
