//! The model lab: fits a model to a session, compares the two, and says which physics is missing, or that nothing is.
//!
//! The order of reading is the order of work:
//!
//! 1. [`plan`]: a session becomes pieces of drive and observations;
//! 2. [`base`], [`fit`]: the parameters that these observations can identify, and their least squares;
//! 3. [`family`], [`ensemble`]: what the fitted base leaves of virtual mirrors with nothing hidden, which is the size and
//!    the shape of the model's approximation;
//! 4. [`space`]: an inner product of residuals in which base and approximation are free;
//! 5. [`candidate`]: every effect in that space;
//! 6. [`diagnose`](diagnose()): thresholds from mirrors of families left out, a verdict, and what to measure next.
//!
//! Only `family` knows the virtual mirror: it calibrates the thresholds. Model and virtual mirror share nothing.

pub mod base;
pub mod candidate;
mod compare;
pub mod confusions;
mod diagnose;
mod edit;
pub mod ensemble;
pub mod family;
pub mod fit;
mod fit_report;
mod heater;
mod identify;
mod judge;
mod likeness;
mod menu;
mod next;
mod noise;
mod placebo;
pub mod plan;
mod plane;
mod report;
pub mod space;
mod surroundings;
mod words;

pub use compare::{Comparison, ExperimentError, StageErrors, compare};
pub use diagnose::diagnose;
pub use edit::{Changed, Edit, EditError, add, remove};
pub use fit_report::{FitReport, fit_and_report};
pub use identify::{Identification, Tried, identify};
pub use menu::commands;
pub use placebo::{Fall, Placebo};
pub use plan::Plan;
pub use plane::Plane;
pub use report::{BeforeAfter, Diagnosis, Estimate, NextMeasurement, Ranked, Verdict};
