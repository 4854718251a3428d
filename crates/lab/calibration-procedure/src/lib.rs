//! The way from an unknown mirror to a calibration, on whatever [`Bench`] there is: a board with a sensor, or the control
//! core in front of a virtual mirror.
//!
//! 1. measure the session's part in which all actuators move alike;
//! 2. identify the mirror by it, and tabulate the model's inverse;
//! 3. try the calibration that the board has;
//! 4. put the new one on trial, and refine it by what the mirror does under it: [`moves`](experiments::calibration::moves)
//!    where a sensor is read at every tick, [`rests`](experiments::calibration::rests) where it is not;
//! 5. try the refined one at positions that it was not made from.

mod bench;
mod procedure;
mod refine;
mod trial;

pub use bench::{Bench, NoDisplacement, Part};
pub use procedure::{Calibrated, Procedure, Source};
pub use trial::{Figures, Point, Series, Trial};
