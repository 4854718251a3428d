//! A value with its uncertainty.

use serde::Serialize;

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
