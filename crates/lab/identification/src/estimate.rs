//! Values with their uncertainty, and their units.

use serde::Serialize;
use std::fmt;

/// The unit of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Of a displacement.
    #[serde(rename = "um")]
    Micrometre,
    /// Of a current.
    #[serde(rename = "mA")]
    Milliampere,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Micrometre => "um",
            Self::Milliampere => "mA",
        })
    }
}

/// A value with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The best value.
    pub value: f64,
    /// One standard deviation, where it is known.
    pub standard_error: Option<f64>,
    /// The unit of both.
    pub unit: String,
}
