//! Measurement files: CSV with `# key=value` comments, one experiment a file, many files a session.
//!
//! ```text
//! # experiment=sweep
//! # noise_z_nm=20
//! t_s,V_V,z_um,I1_A,I2_A,I3_A,I4_A
//! 1,0.0,0.00,0,0,0,0
//! 2,0.1,0.38,2.8e-4,2.8e-4,2.8e-4,2.8e-4
//! ```
//!
//! `docs/reference/measurement-files.md` has the whole format. The columns may stand in any order, and what was not measured is left out or empty. [`mod@column`] lists the columns,
//! [`MeasurementFile`] is a file in memory, [`Session`] the files of one device and day. What is wrong in a file is an
//! [`InputError`] that points at the line and column; [`plausibility`] finds values in the wrong unit.

mod clocks;
pub mod column;
mod correlation;
mod error;
mod file;
mod header;
pub mod held;
pub mod import;
mod keys;
mod lines;
mod one_point;
mod parse;
mod plane;
pub mod plausibility;
mod session;
mod settled;
mod stuck;
mod wholeness;
mod write;

pub use correlation::correlation;
pub use error::{Excerpt, InputError};
pub use file::{ACTUATORS, MeasurementFile, Row};
pub use keys::{CurrentNoise, Keys};
pub use parse::MOST_ROWS;
pub use plane::Plane;
pub use plausibility::{Device, median, median_and_deviation};
pub use session::Session;
pub use settled::Settled;
pub use write::Writer;
