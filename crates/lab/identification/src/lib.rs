//! System identification: fits a model to a measurement session, and compares the two.
//!
//! The order of reading is the order of work:
//!
//! 1. [`plan`]: a session becomes pieces of drive and observations, each with its noise;
//! 2. [`base`], [`heater`]: the parameters that these observations can identify, and where fits of them start;
//! 3. [`fit`](mod@fit): their least squares;
//! 4. [`fit_report`]: what was found, with standard errors, and what these data cannot tell apart;
//! 5. [`identify`](identify()): which stages the data support, for a calibration;
//! 6. [`compare`](compare()): where model and measurement differ, stage by stage.

pub mod base;
mod compare;
mod estimate;
pub mod fit;
pub mod fit_report;
pub mod heater;
mod identify;
mod noise;
pub mod plan;
mod surroundings;

pub use compare::{Comparison, ExperimentError, StageErrors, compare};
pub use estimate::Estimate;
pub use fit_report::{FitReport, fit_and_report};
pub use identify::{Identification, Tried, identify};
pub use plan::Plan;
