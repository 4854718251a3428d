//! What the lab found, with the tool's own command lines for what it proposes.

use std::fmt;

use diagnosis::Diagnosis;
use identification::Identification;
use serde::Serialize;

use crate::command_line::{measure_line, next_line};

/// An identification as the tool says it.
#[derive(Serialize)]
#[serde(transparent)]
pub(crate) struct Identified<'a>(pub(crate) &'a Identification);

impl fmt::Display for Identified<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.describe(f, measure_line)
    }
}

/// A diagnosis as the tool says it.
#[derive(Serialize)]
pub(crate) struct Diagnosed<'a> {
    #[serde(flatten)]
    found: &'a Diagnosis,
    /// How to make the measurement that is proposed.
    next_command: Option<String>,
}

impl<'a> From<&'a Diagnosis> for Diagnosed<'a> {
    fn from(found: &'a Diagnosis) -> Self {
        let next = found.next_measurement.as_ref();
        Self {
            found,
            next_command: next.map(|next| next_line(&next.how)),
        }
    }
}

impl fmt::Display for Diagnosed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.found)?;
        match (&self.next_command, &self.found.next_measurement) {
            (Some(command), Some(next)) => {
                writeln!(f, "\nMeasure next: {command}\n  {}", next.why)
            }
            _ => Ok(()),
        }
    }
}
