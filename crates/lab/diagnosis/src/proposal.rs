//! What a diagnosis proposes to do next, as data: whoever asks has its own words for how.

use experiments::Measurement;
use serde::Serialize;

/// What to measure next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextMeasurement {
    /// What it would tell.
    pub why: String,
    /// What to do.
    pub how: Next,
}

/// What to do next.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Next {
    /// The bench can measure it.
    Measure(Proposal),
    /// It takes other means: what is known of the effect with this id says which.
    ReadAbout(String),
}

/// A measurement, and how it is asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposal {
    /// What is measured.
    pub measurement: Measurement,
    /// How warm the surroundings are to be (degC), where they matter.
    pub ambient_c: Option<f64>,
    /// What to call the file, or the folder, where the measurement's own name would say too little.
    pub name: Option<&'static str>,
}

impl From<Proposal> for Next {
    fn from(proposal: Proposal) -> Self {
        Self::Measure(proposal)
    }
}
