//! A model file's text, and errors that point into it.

use super::error::ModelFileError;
use miette::NamedSource;
use std::sync::Arc;

pub(super) struct ModelReader<'a> {
    pub(super) name: &'a str,
    pub(super) text: &'a str,
}

impl ModelReader<'_> {
    pub(super) fn wrong(
        &self,
        message: String,
        help: String,
        place: std::ops::Range<usize>,
    ) -> ModelFileError {
        let text = Arc::new(NamedSource::new(self.name, self.text.to_owned()));
        ModelFileError::Content {
            message,
            help,
            text,
            place: place.into(),
        }
    }
}
