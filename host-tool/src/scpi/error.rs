//! Errors by SCPI's numbers (SCPI-1999, 21.8), each with a sentence of what happened.

use std::fmt;

use super::quoted;

/// What went wrong, as SCPI sorts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    InvalidCharacter,
    Syntax,
    DataType,
    ParameterNotAllowed,
    MissingParameter,
    UndefinedHeader,
    InvalidSuffix,
    Execution,
    CommandProtected,
    SettingsConflict,
    DataOutOfRange,
    Hardware,
    HardwareMissing,
    QueueOverflow,
    InputBufferOverrun,
    TimeOut,
}

impl Kind {
    /// All of them, in the order of their numbers.
    pub(crate) const ALL: [Self; 16] = [
        Self::InvalidCharacter,
        Self::Syntax,
        Self::DataType,
        Self::ParameterNotAllowed,
        Self::MissingParameter,
        Self::UndefinedHeader,
        Self::InvalidSuffix,
        Self::Execution,
        Self::CommandProtected,
        Self::SettingsConflict,
        Self::DataOutOfRange,
        Self::Hardware,
        Self::HardwareMissing,
        Self::QueueOverflow,
        Self::InputBufferOverrun,
        Self::TimeOut,
    ];

    /// Its number, its name in the standard, and what it means here.
    pub(crate) fn told(self) -> (i16, &'static str, &'static str) {
        match self {
            Self::InvalidCharacter => (-101, "Invalid character", "the line is no text in UTF-8"),
            Self::Syntax => (-102, "Syntax error", "a header or a quote is not one"),
            Self::DataType => (-104, "Data type error", "a parameter is of another kind"),
            Self::ParameterNotAllowed => (-108, "Parameter not allowed", "there are too many"),
            Self::MissingParameter => (-109, "Missing parameter", "there are too few"),
            Self::UndefinedHeader => (-113, "Undefined header", "there is no such command"),
            Self::InvalidSuffix => (-131, "Invalid suffix", "the unit belongs to something else"),
            Self::Execution => (-200, "Execution error", "the board refused, or is in use"),
            Self::CommandProtected => (
                -203,
                "Command protected",
                "another client drives the board, or it was stopped beside this one",
            ),
            Self::SettingsConflict => (
                -221,
                "Settings conflict",
                "what is driven does not allow it, or there is nothing to turn on",
            ),
            Self::DataOutOfRange => (-222, "Data out of range", "nothing was changed"),
            Self::Hardware => (
                -240,
                "Hardware error",
                "a fault has turned the channels off, or the lease of what was driven ended",
            ),
            Self::HardwareMissing => (
                -241,
                "Hardware missing",
                "the board is not there, or does not answer; the next command tries again",
            ),
            Self::QueueOverflow => (-350, "Queue overflow", "later errors were not kept"),
            Self::InputBufferOverrun => (
                -363,
                "Input buffer overrun",
                "a line was too long, or too much waited; what waited was dropped",
            ),
            Self::TimeOut => (
                -365,
                "Time out error",
                "a wait for the mirror to settle has ended, and a limit keeps it away for good",
            ),
        }
    }
}

/// An error of the queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Error {
    pub(crate) kind: Kind,
    /// What happened, and what to do next.
    pub(crate) detail: String,
}

/// Characters of an error's text, the standard's name of it included (SCPI-1999, 21.8.1).
const MOST_CHARACTERS: usize = 255;

impl Error {
    pub(crate) fn new(kind: Kind, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        Self { kind, detail }
    }
}

/// As `SYSTem:ERRor?` answers it.
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (number, name, _) = self.kind.told();
        let text = match self.detail.as_str() {
            "" => name.to_owned(),
            detail => format!("{name};{detail}"),
        };
        let printable = text.chars().filter(|character| !character.is_control());
        let text: String = printable.take(MOST_CHARACTERS).collect();
        write!(f, "{number},{}", quoted(&text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_listed_once_in_the_order_of_the_numbers() {
        let numbers: Vec<i16> = Kind::ALL.iter().map(|kind| -kind.told().0).collect();
        assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    }

    #[test]
    fn a_text_is_one_quoted_line_of_bounded_length() {
        let error = Error::new(Kind::Syntax, "a \"b\"\n c");
        assert_eq!(error.to_string(), "-102,\"Syntax error;a \"\"b\"\" c\"");
        let long = Error::new(Kind::Syntax, "x".repeat(10_000)).to_string();
        assert_eq!(long.chars().count(), MOST_CHARACTERS + "-102,\"\"".len());
    }
}
