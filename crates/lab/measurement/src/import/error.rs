//! Why a table cannot be imported.

use miette::Diagnostic;
use thiserror::Error;

/// Why a table is no measurement.
#[derive(Debug, Error, Diagnostic, PartialEq)]
#[error("{message}")]
#[diagnostic(help("{help}"))]
pub struct ImportError {
    message: String,
    help: String,
}

impl ImportError {
    /// What is wrong, and what to do.
    pub fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
        }
    }

    /// The same of a part of a file.
    #[must_use]
    pub fn within(self, part: &str) -> Self {
        Self::new(format!("{part}: {}", self.message), self.help)
    }
}
