//! From setpoint and sensed currents to four drives.
//!
//! The control core knows no hardware, no executor and no clock: [`Controller::step`] is called once
//! a control tick with what is wanted and what was sensed, and returns what to drive and which limits
//! acted. It inverts the mirror stage by stage, from the position back to the drive:
//!
//! ```text
//! path        where the mirror shall be at the end of this tick        for the mirror
//! memory      creep and hysteresis inverted: z to x
//! shape       x to dT by table                                         for each actuator
//! heat        thermal poles inverted: dT to power
//! resistance  V = sqrt(P R), R corrected by what was sensed
//! drive       PWM codes, the rounding carried on
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
pub mod current;
pub mod design;
mod heat;
mod lag;
mod lane;
pub mod limits;
mod memory;
mod named;
mod output;
mod path;
pub mod sense;
pub mod table;
pub mod units;

pub use calibration::{Calibration, CalibrationError, LaneCalibration};
pub use codes::{AdcCode, PwmCode, SupplyCode};
pub use controller::{Controller, Setpoint, Step};
pub use current::{CurrentSense, SenseCalibration};
pub use design::TICK;
pub use limits::{Limit, Limits};
pub use sense::LaneSense;
pub use table::InverseTable;
pub use units::{Ampere, Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, Volt, Watt};

/// Actuators of the mirror, channels of the board, lanes of the controller.
pub const LANES: usize = 4;
