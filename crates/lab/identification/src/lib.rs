//! System identification: fits a model to a measurement session, and compares the two.
//!
//! The order of reading is the order of work, and no module knows one below it:
//!
//! 1. [`dataset`]: a session becomes pieces of drive and observations, each with its noise;
//! 2. [`parameter`], [`prediction`]: what a fit may change, and what the model then predicts of the observations;
//! 3. [`heater`], [`base`]: which parameters these observations can identify, and where fits of them start;
//! 4. [`fit`](mod@fit): their least squares;
//! 5. [`fit_report`]: what was found, with standard errors, and what these data cannot tell apart;
//! 6. [`identify`](identify()): which stages the data support, for a calibration;
//! 7. [`compare`](compare()): where model and measurement differ, stage by stage.

pub mod base;
mod compare;
pub mod dataset;
mod digit;
mod estimate;
pub mod fit;
pub mod fit_report;
pub mod heater;
pub mod heating;
mod identify;
mod noise;
pub mod parameter;
pub mod prediction;
mod surroundings;

pub use compare::{
    Comparison, ExperimentError, StageErrors, StagePoint, compare, compare_predicted, jumps,
    unlike_actuator, unlike_heaters, wild_readings,
};
pub use dataset::Dataset;
pub use estimate::{Estimate, Unit};
pub use fit_report::{FitReport, fit_and_report};
pub use identify::{Identification, Tried, identify};
