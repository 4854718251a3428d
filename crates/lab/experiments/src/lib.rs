//! What is measured on a mirror: every experiment once, as data.
//!
//! An [`Experiment`] says what moves, how, and when it is read, in volts, micrometres and seconds. It knows no board, no
//! virtual mirror and no file. Whoever measures has an adapter: the tool plays it on a board, the closed loop on the
//! control core, the virtual sessions on a virtual mirror, and the diagnosis predicts what it would read.
//!
//! - [`Measurement`] is what a person asks for by name, with its numbers; it makes experiments;
//! - [`session`] is what a fit and a diagnosis want;
//! - [`calibration`] is what refines and tries a calibration;
//! - [`instruments`] says how exactly the bench reads.

pub mod calibration;
mod dwell;
mod experiment;
pub mod instruments;
mod measurement;
mod reading;
mod session;
mod tilt;

pub use dwell::Dwell;
pub use experiment::{ACTUATORS, Experiment, Prehold, Quantity, Run, Signal, Wave};
pub use measurement::Measurement;
pub use reading::{Reading, SLOWING};
pub use session::{OVEN_K, SETTLING_S, session, session_in_common, with_oven_and_reference};
pub use tilt::{Beginnings, Tilt, Turns};
