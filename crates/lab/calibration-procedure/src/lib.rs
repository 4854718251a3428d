//! The way from an unknown mirror to a calibration, on whatever [`Bench`] there is: a board with a sensor, or the control
//! core in front of a virtual mirror.
//!
//! 1. check that the mirror comes back to where it rests;
//! 2. measure the session's part in which all actuators move alike;
//! 3. identify the mirror by it, and tabulate the model's inverse;
//! 4. try the calibration that the board has;
//! 5. put the new one on trial, and refine it by what the mirror does under it: [`moves`](experiments::calibration::moves)
//!    where a sensor is read at every tick, [`rests`](experiments::calibration::rests) where it is not;
//! 6. try the refined one at positions that it was not made from;
//! 7. check that the mirror does what it did at first, and doubt the refined one where it is worse than the one before, or
//!    than its own residuals promise.
//!
//! A reading of the sensor that is missing, stands alone, stays the same while the mirror is driven on, or stands at an end of its range bears no weight anywhere.

mod bench;
mod doubt;
mod drift;
mod drift_check;
mod heaters;
mod procedure;
mod refine;
mod screened;
mod screening;
mod travel;
mod trial;

pub use bench::{Bench, Part};
pub use doubt::{BROKEN_PROMISE, Doubt};
pub use drift::Drift;
pub use heaters::Heaters;
pub use procedure::{Calibrated, Procedure, Source};
pub use screening::{ReadingCounts, SensorError};
pub use travel::TravelError;
pub use trial::{Figures, Point, Series, Trial};
