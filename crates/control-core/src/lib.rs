//! From setpoint and sensed currents to four drives.
//!
//! The control core knows no hardware, no executor and no clock: [`Controller::step`] is called once
//! a control tick with what is wanted and what was sensed, and returns what to drive and which limits
//! acted. It inverts the mirror stage by stage, from the position back to the drive:
//!
//! ```text
//! setpoint -> shape          -> heat              -> resistance          -> drive
//! z           z to dT (table)   P = dT / R_T         R = R0 (1 + xi dT)     V = sqrt(P R)
//! ```
//!
//! and reads the currents in the forward direction, so that each lane also tells the resistance and
//! the temperature that its own current implies ([`sense`]).
//!
//! All arithmetic is `f32`. Every input is answered, whatever its bit pattern: what is out of range
//! is limited, and the limit is named.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod calibration;
pub mod codes;
pub mod controller;
pub mod limits;
pub mod sense;
pub mod table;
pub mod units;

pub use calibration::{Calibration, CalibrationError, LaneCalibration};
pub use codes::{AdcCode, PwmCode, SupplyCode};
pub use controller::{Controller, Setpoint, Step};
pub use limits::{Limit, Limits};
pub use sense::LaneSense;
pub use table::InverseTable;
pub use units::{Ampere, Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, Volt, Watt};

/// Actuators of the mirror, channels of the board, lanes of the controller.
pub const LANES: usize = 4;
