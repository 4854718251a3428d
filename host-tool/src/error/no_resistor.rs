//! What is connected where a known resistor was to tell a current sense's gain.

use quantities::Resistance;

/// Why a gain is not taken. The sense is as it was.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum NoResistor {
    #[error(
        "what is on actuator {actuator} is no resistor but a heater that warms: {low_ohm:.1} ohm at {low_v} V and {high_ohm:.1} ohm at {high_v} V; \
         nothing was changed"
    )]
    #[diagnostic(help(
        "the mirror is connected still: put the resistor in the place of each actuator, and ask again. Without --resistor, \
         `host-tool calibrate-sense` finds the zero with the mirror in place"
    ))]
    #[strum(serialize = "resistor-warms")]
    Warms {
        actuator: usize,
        low_ohm: f64,
        low_v: f64,
        high_ohm: f64,
        high_v: f64,
    },

    #[error(
        "what is on actuator {actuator} is not {resistor}: at {drive_v} V the board reads {:.4} mA, as designed, and {:.4} mA should flow; a sound \
         board is off by {:.1} % at most; nothing was changed",
        1e3 * read_a,
        1e3 * flows_a,
        1e2 * beyond
    )]
    #[diagnostic(help(
        "is the mirror connected still, or another resistor than was named? Look at that actuator's, measure its value, and ask again"
    ))]
    #[strum(serialize = "resistor-other")]
    Gain {
        actuator: usize,
        resistor: Resistance,
        drive_v: f64,
        read_a: f64,
        flows_a: f64,
        beyond: f64,
    },
}
