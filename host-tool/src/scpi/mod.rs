//! SCPI as a text: headers, messages, errors, status registers. Nothing here knows of boards or sockets.
//!
//! IEEE 488.2-1992 says what a message is and how status is reported, SCPI-1999 how headers are abbreviated, what errors are
//! numbered, and what the registers beyond the common ones are.

mod error;
mod header;
mod input;
mod message;
mod status;

pub(crate) use error::{Error, Kind};
pub(crate) use header::matches;
pub(crate) use input::{Input, MOST_LINE_BYTES};
pub(crate) use message::{Unit, units};
pub(crate) use status::{Group, Status, event};

/// What stands for a number that is not known (SCPI-1999, 7.2.1.5).
pub(crate) const NOT_A_NUMBER: &str = "9.91E37";

/// A text as string response data: quotes within are doubled (IEEE 488.2, 8.7.8).
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
