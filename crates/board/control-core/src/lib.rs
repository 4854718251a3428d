//! From setpoint and sensed currents to four drives.
//!
//! The control core knows no hardware, no executor and no clock: [`Controller::step`] is called once
//! a control tick with what is wanted and what was sensed, and returns what to drive and which limits
//! acted. It inverts the mirror stage by stage, from the position back to the drive:
//!
//! ```text
//! plate       pose of the plate to positions of its actuators          for the mirror
//! path        where they shall be at the end of this tick
//! memory      creep and hysteresis inverted: z to x                    for each actuator
//! shape       x to dT by table, less what the surroundings bend
//! heat        thermal poles inverted: dT to power
//! resistance  V = sqrt(P R), R corrected by what was sensed
//! drive       volts to PWM codes by a first-order error-feedback quantiser
//! ```
//!
//! and reads the currents in the forward direction, so that each actuator also tells the resistance and
//! the temperature that its own current implies ([`resistance`]); from them follow the surroundings ([`surroundings`]).
//! What no drive depends on, how far the plate may be off and when it will be there, [`Controller::foresee`] tells.
//!
//! All arithmetic is `f32`. Every input is answered, whatever its bit pattern: what is out of range
//! is limited, and the limit is named.
#![no_std]

#[cfg(test)]
extern crate std;

mod actuator;
mod between;
pub mod calibration;
pub mod codes;
pub mod controller;
pub mod current;
pub mod design;
mod drive;
mod heat;
mod lag;
pub mod limits;
mod memory;
mod named;
mod path;
pub mod plate;
pub mod resistance;
mod settling;
pub mod shape;
mod shaper;
pub mod surroundings;
mod uncertainty;
pub mod units;

pub use calibration::{ActuatorCalibration, Calibration, CalibrationError};
pub use codes::{AdcCode, PwmCode, SensorCode, SupplyCode};
pub use controller::{Controller, Retained, Setpoint, Step};
pub use current::{CurrentSense, SenseCalibration};
pub use design::TICK;
pub use limits::{Limit, Limits};
pub use plate::{PlateInverse, Pose};
pub use resistance::ActuatorSense;
pub use shape::InverseTable;
pub use surroundings::Estimate;
pub use uncertainty::Uncertainty;
pub use units::{
    Ampere, Hertz, Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Radian, Second,
    SecondPerKelvin, Volt, Watt,
};

/// Channels of the board, each of which drives one actuator of the mirror.
pub const CHANNELS: usize = 4;
