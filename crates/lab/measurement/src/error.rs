//! What can be wrong with a measurement file, for people.

use crate::lines::Line;
use input_file::ReadError;
use miette::{
    Diagnostic, MietteError, MietteSpanContents, SourceCode, SourceOffset, SourceSpan, SpanContents,
};
use std::sync::Arc;
use thiserror::Error;

/// Why a file or a session is not usable. Nothing of it is kept.
#[derive(Debug, Error, Diagnostic)]
pub enum InputError {
    /// The file or folder is not there, may not be read, or is no file.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] ReadError),
    /// More than is read of a measurement.
    #[error(
        "'{path}' has {size_mb:.0} MB, and at most {most_mb:.0} MB are read of a measurement file"
    )]
    #[diagnostic(help(
        "is it the right file? If so, thin it, or leave out the columns that are not needed"
    ))]
    TooLarge {
        /// The file.
        path: String,
        /// Its size (MB).
        size_mb: f64,
        /// The most that is read (MB).
        most_mb: f64,
    },
    /// A folder, or a list of files, without a measurement.
    #[error("'{path}' holds no measurement files")]
    #[diagnostic(help("measurement files end in .csv"))]
    NoFiles {
        /// The folder.
        path: String,
    },
    /// A file that would count twice.
    #[error("'{path}' is there twice: as '{other}' too, and its rows would count twice")]
    #[diagnostic(help("name it once, or the folder that it is in"))]
    Twice {
        /// The file.
        path: String,
        /// What it was called before.
        other: String,
    },
    /// One drive, at which nothing moves: nothing can be fitted to it.
    #[error(
        "all readings are of one operating point, {drive}: no parameter and no effect can be told from it"
    )]
    #[diagnostic(help(
        "measure at several drives, from 0 V to the highest, as `measure sweep` does; `compare` takes one point"
    ))]
    OnePoint {
        /// Its drive.
        drive: String,
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
        /// The line.
        #[source_code]
        text: Arc<Excerpt>,
        /// Where it is wrong, in the file.
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

/// A line of a file, for an error that counts places from the file's beginning.
#[derive(Debug)]
pub struct Excerpt {
    name: String,
    line: Line,
}

impl Excerpt {
    pub(crate) fn new(name: &str, line: &Line) -> Self {
        Self {
            name: name.to_owned(),
            line: Line {
                text: printable(&line.text),
                ..line.clone()
            },
        }
    }
}

/// A text as a terminal can show it without doing what it says.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(shown).collect()
}

/// In as many bytes, so that places stay what they are.
fn shown(character: char) -> char {
    match (character, character.len_utf8()) {
        ('\t', _) => character,
        (control, 1) if control.is_control() => '.',
        (control, _) if control.is_control() => '\u{b7}',
        _ => character,
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        context_lines_before: usize,
        context_lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let start = span
            .offset()
            .checked_sub(self.line.start)
            .ok_or(MietteError::OutOfBounds)?;
        let within = SourceSpan::new(start.into(), span.len());
        let found = self
            .line
            .text
            .read_span(&within, context_lines_before, context_lines_after)?;
        let place: SourceOffset = (found.span().offset() + self.line.start).into();
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            found.data(),
            SourceSpan::new(place, found.span().len()),
            found.line() + self.line.number.saturating_sub(1),
            found.column(),
            found.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_of_a_file_does_nothing_to_a_terminal() {
        let text = "a\t\u{1b}[2J\u{9b}1mµ";
        let line = Line {
            text: text.to_owned(),
            start: 10,
            number: 3,
            ended: true,
        };
        let excerpt = Excerpt::new("a.csv", &line);
        let span = SourceSpan::new(10.into(), text.len());
        let found = excerpt.read_span(&span, 0, 0).expect("it is in the line");
        let said = std::str::from_utf8(found.data()).expect("text");
        assert_eq!(said, "a\t.[2J\u{b7}1mµ");
        assert_eq!(said.len(), text.len());
    }
}
