//! What a diagnosis says, as data (for `--json`) and in words.

use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

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
    /// Whether the size that fits is inside what such mirrors can have.
    pub plausible: bool,
    /// Values that fit best.
    pub parameters: BTreeMap<String, Estimate>,
    /// Effects that would explain nearly as much.
    pub look_alikes: Vec<String>,
    /// Why it is, or is not, the one.
    pub why: String,
}

/// What to measure next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextMeasurement {
    /// What it would tell.
    pub why: String,
    /// How to make it.
    pub command: String,
}

/// A diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The outcome.
    pub verdict: Verdict,
    /// The named effect, or the ambiguous set with the best first, or nothing.
    pub effects: Vec<String>,
    /// Size of what lumped equations leave of mirrors like this with nothing hidden.
    pub approximation_rms_um: f64,
    /// The error, without and with the best effect.
    pub error_rms_um: BeforeAfter,
    /// Misfit beyond base and approximation, in units of what mirrors with nothing hidden show (1: like them).
    pub misfit: f64,
    /// How far halving the simulation's step moves any prediction, in units of what a reading is trusted to.
    pub solver_error: f64,
    /// All effects, best first.
    pub ranking: Vec<Ranked>,
    /// What would separate the rivals.
    pub next_measurement: Option<NextMeasurement>,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = self.effects.join(", ");
        match self.verdict {
            Verdict::Named => writeln!(f, "Missing: {list}")?,
            Verdict::Ambiguous => {
                writeln!(f, "Missing: one of {list}; these data cannot tell which")?
            }
            Verdict::Unknown => writeln!(
                f,
                "Something is missing, and none of the known effects explains it"
            )?,
            Verdict::None => writeln!(
                f,
                "Nothing is missing: what is left is noise and the model's approximation"
            )?,
        }
        writeln!(
            f,
            "  error {:.3} um, with the best effect {:.3} um",
            self.error_rms_um.before, self.error_rms_um.after
        )?;
        writeln!(
            f,
            "  the model's approximation on mirrors with nothing hidden: {:.3} um",
            self.approximation_rms_um
        )?;
        writeln!(
            f,
            "  misfit beyond that: {:.2} times what such mirrors show\n",
            self.misfit
        )?;
        writeln!(
            f,
            "  {:<22} {:>10} {:>10} {:>6}  size that fits, limit of detection",
            "effect", "score", "threshold", "share"
        )?;
        for ranked in self.ranking.iter().take(8) {
            writeln!(f, "  {ranked}")?;
        }
        for ranked in self
            .ranking
            .iter()
            .filter(|ranked| self.effects.contains(&ranked.effect))
        {
            writeln!(f, "\n  {}: {}", ranked.effect, ranked.why)?;
        }
        if let Some(next) = &self.next_measurement {
            writeln!(f, "\nMeasure next: {}\n  {}", next.command, next.why)?;
        }
        Ok(())
    }
}

impl fmt::Display for Ranked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            effect,
            score,
            threshold,
            probability,
            ..
        } = self;
        write!(
            f,
            "{effect:<22} {score:>10.1} {threshold:>10.1} {:>5.0}% ",
            100.0 * probability
        )?;
        for (symbol, estimate) in &self.parameters {
            write!(f, " {symbol} {:.3e}", estimate.value)?;
            if let Some(error) = estimate.standard_error {
                write!(f, " +- {error:.1e}")?;
            }
            write!(
                f,
                " {}",
                if estimate.unit == "1" {
                    ""
                } else {
                    &estimate.unit
                }
            )?;
        }
        match self.detection_limit {
            Some(limit) => write!(f, "; limit {limit:.1e}"),
            None => write!(f, "; invisible here"),
        }
    }
}
