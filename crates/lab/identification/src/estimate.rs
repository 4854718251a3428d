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

/// What stands in the place of a standard error where a bound of the fit holds the value.
const HELD: &str = "at an end of its range";

/// A value with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The best value.
    pub value: f64,
    /// One standard deviation, where it is known: a bound that holds the value leaves none.
    pub standard_error: Option<f64>,
    /// The unit of both.
    pub unit: String,
}

impl Estimate {
    /// A line of a table, after a name in a column of this width.
    pub(crate) fn line(&self, name: &str, width: usize) -> String {
        let Self { value, unit, .. } = self;
        match self.standard_error {
            Some(error) => format!("  {name:<width$} {value:>13.6e} +- {error:.1e} {unit}"),
            None => format!("  {name:<width$} {value:>13.6e} {unit}, {HELD}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_a_bound_holds_says_so_in_the_place_of_its_error() {
        let mut estimate = Estimate {
            value: 0.3,
            standard_error: Some(2.3e-3),
            unit: "s".into(),
        };
        assert_eq!(
            estimate.line("tau_mid", 8),
            "  tau_mid    3.000000e-1 +- 2.3e-3 s"
        );
        estimate.standard_error = None;
        assert_eq!(
            estimate.line("tau_mid", 8),
            "  tau_mid    3.000000e-1 s, at an end of its range"
        );
    }
}
