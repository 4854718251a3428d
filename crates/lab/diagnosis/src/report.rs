//! What a diagnosis says, as data.

use crate::null_improvement::NullImprovement;
use crate::proposal::{NextMeasurement, Proposal};
use crate::whereabouts::Whereabouts;
use identification::{Estimate, Unit};
use mirror_model::effect::Stage;
use serde::Serialize;
use std::collections::BTreeMap;

/// An error that falls by less than this share of itself has not fallen: the rms of a thousand noisy readings is known to
/// 1 / sqrt(2 * 1000).
pub(crate) const WORTHWHILE: f64 = 0.02;
/// One that falls by less than this has not fallen either (um or mA): 10 pm and 10 nA, below any sensor's noise.
const NOTHING: f64 = 1e-5;

/// Suspects that are less than so many times as far apart are told apart no better: of 240 mirrors a size is known to a few
/// percent, and of one description among many to some ten.
const APART: f64 = 1.5;

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
    /// What is left is noise and the model's discrepancy.
    None,
}

/// A root mean square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rms {
    /// Its size.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
}

/// Root mean squares of a residual, without and with an effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// Of the base alone.
    pub before: f64,
    /// With the effect added.
    pub after: f64,
    /// The unit of both.
    pub unit: Unit,
}

impl BeforeAfter {
    /// By which part of itself the error falls; 0 where it is too small to.
    pub fn fall(&self) -> f64 {
        let fall = self.before - self.after;
        if fall.abs() < NOTHING {
            0.0
        } else {
            fall / self.before
        }
    }
}

/// What a named effect leaves that mirrors with nothing missing would not: what something else does, for the next round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// Its size.
    pub rms: Rms,
    /// Whether the named effect takes most of the error all the same.
    pub is_the_lesser_part: bool,
    /// The highest drive up to which the effect alone explains the readings (V), where there is one.
    pub up_to_v: Option<f64>,
}

/// Which gains a diagnosis is to tell besides.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// Those of facts of the mirror.
    pub facts: bool,
    /// Those of measurements.
    pub measurements: bool,
}

/// The gains that were asked for, the most first.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExpectedGains {
    /// Of every fact that the model file does not state of the mirror.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facts: Option<Vec<ExpectedGain>>,
    /// Of every measurement that could be made besides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measurements: Option<Vec<ExpectedGain>>,
}

/// By what more would be seen.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Means {
    /// A fact of the mirror, by its key in `[device]` of the model file.
    #[serde(rename = "key")]
    Fact(String),
    /// One more measurement.
    Measurement(Proposal),
}

/// What it would be worth to know or to measure something.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectedGain {
    /// What to find out.
    #[serde(flatten)]
    pub means: Means,
    /// The same in words, and how well.
    pub what: String,
    /// Effects that this session does not show at their usual sizes, and then would, or at half of the size that it takes now.
    pub shows: Vec<Shown>,
    /// How many times as far apart the suspects would be whose predictions differ least, where there are several.
    pub tells_apart: Option<f64>,
    /// How likely the verdict is right, now and then.
    pub right: Right,
}

impl ExpectedGain {
    /// The more, the better: by how much likelier a right verdict becomes.
    pub(crate) fn rank(&self) -> f64 {
        self.right.then - self.right.now
    }

    /// Whether it shows anything, or tells suspects apart half as far again.
    pub fn is_some(&self) -> bool {
        !self.shows.is_empty() || self.tells_apart.is_some_and(|times| times >= APART)
    }
}

/// How likely a verdict is right, of what the suspects are: where there are several, that it tells the two that differ least; else
/// that it shows an effect of usual size, in the mean over all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Right {
    /// The two suspects.
    pub between: Option<[String; 2]>,
    /// By this session.
    pub now: f64,
    /// By the one that would be.
    pub then: f64,
}

/// An effect that would be shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// Its id.
    pub effect: String,
    /// Symbol of its strength, its first parameter.
    pub symbol: String,
    /// The unit of that.
    pub unit: String,
    /// The strength above which it is seen now; none if never.
    pub now: Option<f64>,
    /// The same then.
    pub then: f64,
}

/// The form of an effect that nature has in several.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Form {
    /// The best one; of those that cannot be told apart, the one that the control core inverts.
    pub name: String,
    /// Others that cannot be told from it.
    pub alike: Vec<String>,
    /// The one that the control core inverts, where that is another one and fits clearly less.
    pub inverted: Option<String>,
}

/// One effect's place in the ranking.
#[derive(Clone, Debug, Serialize)]
pub struct Ranked {
    /// Its id.
    pub effect: String,
    /// Its form, where it is named and has several.
    pub form: Option<Form>,
    /// How much of the misfit it explains beyond base and discrepancy, less the price of its parameters.
    pub score: f64,
    /// The score that mirrors which lack nothing stay below in 95 of 100 cases, whichever effect is tried.
    pub threshold: f64,
    /// Its scores in the mirrors of the null ensemble, from which the threshold comes. Not for `--json`.
    #[serde(skip)]
    pub null_scores: Vec<f64>,
    /// Its Akaike weight among the effects above their thresholds and their rivals, 0 to 1.
    pub weight: f64,
    /// The strength above which it would have been seen, in the unit of its first parameter; none if never.
    pub detection_limit: Option<f64>,
    /// On rows held out of the fit of its strength, what is left without it and with it, where base and discrepancy are fitted to
    /// the other rows: of the displacement (of the currents where no displacement was measured).
    pub held_out_rms: BeforeAfter,
    /// Errors of the displacement without it, and with it and everything fitted together (of the currents, where no
    /// displacement was measured).
    pub error_rms: BeforeAfter,
    /// The same of the currents, where both were measured.
    pub current_rms: Option<BeforeAfter>,
    /// By how much the same addition lowers the errors of mirrors that lack nothing, for effects above their thresholds.
    pub null_improvement: Option<NullImprovement>,
    /// Whether the size that fits is inside what such mirrors can have.
    pub plausible: bool,
    /// Values that fit best.
    pub parameters: BTreeMap<String, Estimate>,
    /// Effects that would explain nearly as much.
    pub look_alikes: Vec<String>,
    /// Why it is, or is not, the one.
    pub why: String,
}

impl Ranked {
    /// Whether it scores more than mirrors that lack nothing.
    pub(crate) fn is_above(&self) -> bool {
        self.score > self.threshold
    }
}

/// The best of the effects that are named, or of all where none is.
pub(crate) fn leading<'a>(ranking: &'a [Ranked], named: &[String]) -> Option<&'a Ranked> {
    let is_named = |ranked: &&Ranked| named.contains(&ranked.effect);
    ranking.iter().find(is_named).or(ranking.first())
}

/// A formula for what no known effect explains. It is no name: something behaves like it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProposedForm {
    /// What its file calls it.
    pub effect: String,
    /// The effect file, as `effect add` takes it.
    pub text: String,
    /// The same in a sentence.
    pub sentence: String,
    /// The stage of the chain that it acts on: the likely one, unless no formula there explains as much.
    pub stage: Stage,
    /// How much of the misfit it explains, less the price of its parameters.
    pub score: f64,
    /// The score of the best formula that mirrors which lack nothing stay below in 95 of 100 cases.
    pub threshold: f64,
    /// Errors without it, and with it and everything fitted together.
    pub error_rms: BeforeAfter,
    /// The same on readings held out of the fit.
    pub held_out_rms: BeforeAfter,
    /// The same of the currents, where displacement and currents were measured: one of the two falls.
    pub current_rms: Option<BeforeAfter>,
}

/// A diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The outcome.
    pub verdict: Verdict,
    /// The named effect, or the ambiguous set with the best first, or nothing.
    pub effects: Vec<String>,
    /// Size of what lumped equations leave of the median mirror like this that lacks nothing.
    pub discrepancy_rms: Rms,
    /// Where an effect is named that takes most of the error and leaves a part: what is left.
    pub remainder: Option<Remainder>,
    /// The error, without and with the best of the effects that are named, or of all where none is.
    pub error_rms: BeforeAfter,
    /// Misfit beyond base and discrepancy, over the median one of mirrors that lack nothing (1: like them).
    pub misfit: f64,
    /// How far halving the simulation's step moves any prediction, in standard deviations.
    pub solver_error: f64,
    /// Effects that these data would not show at any plausible strength.
    pub invisible: Vec<String>,
    /// Effects with which the model runs away, whatever their form.
    pub infeasible: Vec<String>,
    /// Rows that were left out because they were more than a diagnosis needs.
    pub thinned_rows: usize,
    /// The experiment that reads otherwise than the others, where that alone explains more than any effect; the first of the notes says how.
    pub odd_file: Option<String>,
    /// Sentences on what was done to the readings before.
    pub notes: Vec<String>,
    /// All effects that change a reading, best first.
    pub ranking: Vec<Ranked>,
    /// Where it is, without a list of effects; none where nothing is missing, or no place is above its threshold.
    pub whereabouts: Option<Whereabouts>,
    /// A form for what no known effect explains, where one is good enough.
    pub proposal: Option<ProposedForm>,
    /// What would separate the rivals.
    pub next_measurement: Option<NextMeasurement>,
}
