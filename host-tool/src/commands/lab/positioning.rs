//! What an effect in the model is worth where the mirror is positioned.

use std::fmt;

use calibration::{Left, Rehearsal, Remaining, TabulateError, rehearse, tabulate};
use mirror_model::Model;
use serde::Serialize;

/// Errors along a standard path on a mirror that has the effect, or why there are none.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Positioning {
    Possible {
        /// A board that does not know of the effect.
        without: Left,
        /// The effect in the tables for rest only, and in the stages in time, too.
        with: Rehearsal,
        /// What the board cannot invert, and why.
        remaining: Vec<Remaining>,
    },
    Impossible {
        why: String,
    },
}

impl Positioning {
    /// On a mirror that is the model with the effect: a board calibrated with either.
    pub(super) fn new(without: &Model, with: &Model) -> Self {
        Self::rehearsed(without, with).unwrap_or_else(|error| Self::Impossible {
            why: error.to_string(),
        })
    }

    fn rehearsed(without: &Model, with: &Model) -> Result<Self, TabulateError> {
        Ok(Self::Possible {
            without: rehearse(with, without)?.in_time,
            with: rehearse(with, with)?,
            remaining: tabulate(with)?.remaining,
        })
    }
}

impl fmt::Display for Positioning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (without, with, remaining) = match self {
            Self::Impossible { why } => return writeln!(f, "  no positioning with it: {why}"),
            Self::Possible {
                without,
                with,
                remaining,
            } => (without, with, remaining),
        };
        writeln!(
            f,
            "  positioning a mirror that is this model with it, along moves, rests and sines of 1 and 20 Hz:"
        )?;
        for (what, left) in [
            ("a board that does not know it", without),
            ("with it, tables for rest alone", &with.at_rest),
            ("with it, and its feedforward", &with.in_time),
        ] {
            writeln!(
                f,
                "    {what:<32} {:>8.3} um rms, {:.3} um at most",
                left.rms_um, left.largest_um
            )?;
        }
        for Remaining { effect, because } in remaining {
            writeln!(f, "    {effect} remains: {because}")?;
        }
        Ok(())
    }
}
