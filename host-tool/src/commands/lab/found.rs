//! What the lab found, with the tool's own command lines for what it proposes.

use std::fmt;

use diagnosis::{Diagnosis, Worth};
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
    /// What facts of the mirror would be worth, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    facts: Option<Vec<Worth>>,
}

impl<'a> Diagnosed<'a> {
    pub(crate) fn new(found: &'a Diagnosis, facts: Option<Vec<Worth>>) -> Self {
        let next = found.next_measurement.as_ref();
        Self {
            found,
            next_command: next.map(|next| next_line(&next.how)),
            facts,
        }
    }
}

impl fmt::Display for Diagnosed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.found)?;
        if let (Some(command), Some(next)) = (&self.next_command, &self.found.next_measurement) {
            writeln!(f, "\nMeasure next: {command}\n  {}", next.why)?;
        }
        let Some(facts) = &self.facts else {
            return Ok(());
        };
        let mut worthwhile = facts.iter().filter(|worth| worth.is_some()).peekable();
        if worthwhile.peek().is_none() {
            return writeln!(f, "\nNo fact of the mirror alone would show more");
        }
        writeln!(f, "\nFind out of the mirror, what helps most first:")?;
        worthwhile.try_for_each(|worth| writeln!(f, "  {worth}"))
    }
}
