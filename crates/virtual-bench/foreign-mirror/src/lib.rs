//! A mirror that nobody who developed the model or the virtual mirror has had in mind.
//!
//! Its heat sits in lumps: a heater and a beam for each actuator, and one substrate that all share. What goes to the air goes by
//! free convection, with the power 5/4 of the temperature; the rest is conducted away. A beam turns a lever, which is all its
//! geometry, against friction ([`Friction`]) and on a material that gives way slowly ([`Creep`]); the plate then rings in its
//! three coordinates ([`Ringing`]). It depends on no other package of this project, and shares no equation with any.
//!
//! ```
//! use foreign_mirror::{ForeignConfig, ForeignMirror};
//!
//! let mut mirror = ForeignMirror::new(&ForeignConfig::new(7));
//! mirror.step([2.5; 4], 0.5);
//! assert!(mirror.z_um() > 50.0 && mirror.current_a()[0] > 5e-3);
//! ```

mod config;
mod heat;
mod memory;
mod mirror;
mod ringing;

pub use config::ForeignConfig;
pub use memory::{Creep, Friction};
pub use mirror::ForeignMirror;
pub use ringing::Ringing;
