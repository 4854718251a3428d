//! What a diagnosis says, as data.

use crate::placebo::Placebo;
use crate::proposal::NextMeasurement;
use identification::Estimate;
use serde::Serialize;
use std::collections::BTreeMap;

/// The outcome of a diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// One effect is missing.
    Named,
    /// One of a few effects is missing, and these data cannot tell which.
    Ambiguous,
    /// Something is missing, but none of the known effects.
    Unknown,
    /// What is left is noise and the model's approximation.
    None,
}

/// Root mean squares of the displacement's residual (of the current's in mA where there is no displacement).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// Of the base alone.
    pub before: f64,
    /// With the best effect added.
    pub after: f64,
}

/// One effect's place in the ranking.
#[derive(Clone, Debug, Serialize)]
pub struct Ranked {
    /// Its id.
    pub effect: String,
    /// How much of the misfit it explains beyond base and approximation, less the price of its parameters.
    pub score: f64,
    /// The score that mirrors with nothing hidden stay below in 95 of 100 cases, whichever effect is tried.
    pub threshold: f64,
    /// Its share among the effects above their thresholds.
    pub probability: f64,
    /// The strength above which it would have been seen, in the unit of its first parameter; none if never.
    pub detection_limit: Option<f64>,
    /// Root mean square of the misfit on rows kept out of the fit of its strength (um, or mA without a displacement).
    pub held_out_rms_um: f64,
    /// Errors of the displacement without it, and with it and everything fitted together (of the currents, in mA, where no
    /// displacement was measured).
    pub error_rms_um: BeforeAfter,
    /// The same of the currents, where both were measured.
    pub current_rms_ma: Option<BeforeAfter>,
    /// What the same addition does on mirrors with nothing hidden, for effects above their thresholds.
    pub placebo: Option<Placebo>,
    /// Whether the size that fits is inside what such mirrors can have.
    pub plausible: bool,
    /// Values that fit best.
    pub parameters: BTreeMap<String, Estimate>,
    /// Effects that would explain nearly as much.
    pub look_alikes: Vec<String>,
    /// Why it is, or is not, the one.
    pub why: String,
}

/// A diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The outcome.
    pub verdict: Verdict,
    /// The named effect, or the ambiguous set with the best first, or nothing.
    pub effects: Vec<String>,
    /// Size of what lumped equations leave of the median mirror like this with nothing hidden.
    pub approximation_rms_um: f64,
    /// Unit of the errors: `um` of displacement, or `mA` where no displacement was measured.
    pub unit: &'static str,
    /// The error, without and with the best effect.
    pub error_rms_um: BeforeAfter,
    /// Misfit beyond base and approximation, in units of what mirrors with nothing hidden show (1: like them).
    pub misfit: f64,
    /// How far halving the simulation's step moves any prediction, in units of what a reading is trusted to.
    pub solver_error: f64,
    /// Effects that these data would not show at any size that happens.
    pub invisible: Vec<String>,
    /// All effects that change a reading, best first.
    pub ranking: Vec<Ranked>,
    /// What would separate the rivals.
    pub next_measurement: Option<NextMeasurement>,
}
