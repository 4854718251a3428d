//! Says which physics is missing where a fitted model and a session differ, or that nothing is.
//!
//! The order of reading is the order of work; `identification` has fitted the model before:
//!
//! 1. `null_ensemble`: what the fitted base leaves of virtual mirrors that lack no effect. Its span is the model's
//!    discrepancy;
//! 2. [`residual_space`]: generalised least squares in which base and discrepancy are free;
//! 3. `candidate`: every effect in that space;
//! 4. `null_distribution`: the scores that mirrors of a family left out stay below;
//! 5. [`diagnose`](diagnose()): a verdict, a ranking, and what to measure next;
//! 6. `whereabouts`: where it is, without a list of effects; `formula_search`: the smallest formula that does the same.
//!
//! Only `null_ensemble/families` knows the virtual mirror. Model and virtual mirror share nothing.

mod apart;
mod candidate;
pub mod confusions;
mod diagnose;
mod edit;
mod formula_search;
mod held_out;
mod measured_already;
mod menu;
mod next;
mod null_distribution;
mod null_ensemble;
mod null_improvement;
#[cfg(test)]
mod pages;
mod progress;
mod proposal;
mod quantile;
mod report;
pub mod residual_space;
mod whereabouts;
mod words;

pub use diagnose::{diagnose, diagnose_with_gains};
pub use edit::{Changed, Edit, EditError, add, remove};
pub use menu::proposals;
pub use null_ensemble::families::CALIBRATING;
pub use null_ensemble::{MEMBERS, NullEnsemble};
pub use null_improvement::{Fall, NullImprovement};
pub use proposal::{Next, NextMeasurement, Proposal};
pub use report::{
    Asked, BeforeAfter, Diagnosis, ExpectedGain, ExpectedGains, Form, Means, ProposedForm, Ranked,
    Remainder, Right, Rms, Shown, Verdict,
};
pub use whereabouts::{Driver, Located, Place, Sharpness, StageConfidence, Whereabouts, shares};
