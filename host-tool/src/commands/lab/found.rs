//! What the lab found, with the tool's own command lines for what it proposes.

use std::fmt;

use diagnosis::{Diagnosis, ExpectedGain, ExpectedGains, Means};
use identification::Identification;
use serde::Serialize;

use crate::command_line::{measure_line, next_line, proposal_line};
use crate::terms::terms;

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
    /// What more would be worth, where that was asked for.
    #[serde(flatten)]
    gains: ExpectedGains,
}

impl<'a> Diagnosed<'a> {
    pub(crate) fn new(found: &'a Diagnosis, gains: ExpectedGains) -> Self {
        let next = found.next_measurement.as_ref();
        Self {
            found,
            next_command: next.map(|next| next_line(&next.how)),
            gains,
        }
    }
}

impl fmt::Display for Diagnosed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.found)?;
        if self.found.proposal.is_some() {
            writeln!(
                f,
                "    to keep it: `--propose FILE` writes it as an effect file, `host-tool effect add FILE` adds it"
            )?;
        }
        let terms: Vec<&str> = terms().collect();
        writeln!(
            f,
            "  `host-tool explain NAME` tells what a column or a line says: {}",
            terms.join(", ")
        )?;
        if let (Some(command), Some(next)) = (&self.next_command, &self.found.next_measurement) {
            writeln!(f, "\nMeasure next: {command}\n  {}", next.why)?;
        }
        if let Some(facts) = &self.gains.facts {
            let heading = "Find out of the mirror, what helps most first:";
            let none = "No fact of the mirror alone would show more";
            list(f, facts, heading, none)?;
        }
        if let Some(measurements) = &self.gains.measurements {
            let heading = "Measure besides, what helps most first:";
            let none = match measurements.is_empty() {
                true => {
                    "What another measurement would show cannot be foretold of settled readings, or of a heater: measure a session, and \
                     ask again"
                }
                false => "No measurement of this board and its bench alone would show more",
            };
            list(f, measurements, heading, none)?;
        }
        Ok(())
    }
}

/// Those gains that are any, each with how it is had.
fn list(
    f: &mut fmt::Formatter<'_>,
    gains: &[ExpectedGain],
    heading: &str,
    none: &str,
) -> fmt::Result {
    let mut worthwhile = gains.iter().filter(|worth| worth.is_some()).peekable();
    if worthwhile.peek().is_none() {
        return writeln!(f, "\n{none}");
    }
    writeln!(f, "\n{heading}")?;
    worthwhile.try_for_each(|worth| match &worth.means {
        Means::Fact(key) => writeln!(f, "  {worth}: `{key}` in [device] of the model file"),
        Means::Measurement(proposal) => writeln!(f, "  {worth}: {}", proposal_line(proposal)),
    })
}
