//! Says which physics is missing where a fitted model and a session differ, or that nothing is.
//!
//! The order of reading is the order of work; `identification` has fitted the model before:
//!
//! 1. [`family`], [`ensemble`]: what the fitted base leaves of virtual mirrors with nothing hidden, which is the size and
//!    the shape of the model's approximation;
//! 2. [`space`]: an inner product of residuals in which base and approximation are free;
//! 3. [`candidate`]: every effect in that space;
//! 4. [`diagnose`](diagnose()): thresholds from mirrors of families left out, a verdict, and what to measure next.
//!
//! Only `family` knows the virtual mirror: it calibrates the thresholds. Model and virtual mirror share nothing.

pub mod candidate;
pub mod confusions;
mod diagnose;
mod edit;
pub mod ensemble;
pub mod family;
mod judge;
mod likeness;
mod menu;
mod next;
mod placebo;
mod proposal;
mod report;
pub mod space;
mod words;

use identification::{fit_report, heater};

// Names that follow `identification` one file at a time.
mod base {
    pub(crate) use identification::base::*;
}
mod fit {
    pub(crate) use identification::fit::{
        Fitted, best_fit, fit, fit_parameters as fit_knobs, free_parameters as knobs,
    };
    pub(crate) use identification::parameter::FreeParameter as Knob;
    pub(crate) use identification::prediction::{
        RESOLUTION, jacobian, predict, standard_deviation as trust,
        standardised as in_units_of_trust, white_noise,
    };
}
mod plan {
    pub(crate) use identification::dataset::{Channel, Dataset as Plan, Observation, OwnZero, rms};
}

pub use diagnose::diagnose;
pub use edit::{Changed, Edit, EditError, add, remove};
pub use menu::proposals;
pub use placebo::{Fall, Placebo};
pub use proposal::{Next, NextMeasurement, Proposal};
pub use report::{BeforeAfter, Diagnosis, Ranked, Verdict};
