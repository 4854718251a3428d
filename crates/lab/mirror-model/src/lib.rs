//! The piston model of an electrothermal (inverted-series-connected bimorph) MEMS mirror.
//!
//! The equations are those of the paper that this project starts from (`docs/theory/model.md` tells where that paper contradicts
//! itself). The chain runs `V -> R(dT), P -> dT -> 1/rho -> z`; every link can be asked for on its own:
//!
//! - [`PistonModel`] is one actuator's chain, forward and inverse;
//! - [`Parameters`] are its numbers, and [`parameter::TABLE`] tells a symbol, a unit and a meaning for each;
//! - [`identify()`] finds one parameter from measured points;
//! - [`Preset`] and [`Model`] are the named and the stored sets of parameters.
//!
//! ```
//! use mirror_model::Model;
//!
//! let mirror = Model::load("reconciled")?.actuator(0);
//! let voltage = mirror.voltage_at(120.0)?;
//! let state = mirror.state_at_voltage(voltage);
//! assert!((state.z_um - 120.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bimorph;
pub mod device;
pub mod effect;
pub mod file;
pub mod identify;
pub mod model;
pub mod parameter;
pub mod piston;
pub mod preset;
mod root;
pub mod simulate;

pub use bimorph::Deflection;
pub use device::Device;
pub use file::ModelFileError;
pub use identify::{Identified, MeasuredPoint, identify};
pub use model::{ACTUATORS, Measured, Model, Provenance};
pub use parameter::{Parameters, Symbol};
pub use piston::{PistonModel, PistonState, RangeError};
pub use preset::Preset;
pub use simulate::{Interval, Output, Runaway, Simulation, simulate};
