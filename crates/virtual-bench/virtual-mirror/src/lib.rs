//! A virtual mirror that is not the model.
//!
//! An electrothermal mirror of four actuators, computed from films, lengths and heat balances: one-dimensional heat flow
//! along every beam, a platinum heater whose resistance follows the local temperature, a shape summed from the local
//! curvature, a plate that rings. It shares no equation with the lumped piston model and must never depend on that
//! crate: data that test a model have to come from elsewhere.
//!
//! ```
//! use virtual_mirror::{MirrorConfig, Sensor, VirtualMirror};
//!
//! let config = MirrorConfig::bench(); // or from_file("my.toml")?, from_toml(text)?
//! let mut mirror = VirtualMirror::new(&config)?;
//!
//! mirror.step([1.9; 4], 100e-6); // hold four voltages for one tick
//! mirror.advance([1.9; 4], 2.0); // hold them for seconds, as exact, in long strides
//! mirror.advance_ramp([2.0; 4], 0.1); // move them in a straight line
//!
//! let state = mirror.state(); // z_um, tilts, four currents, hottest temperature: no noise
//! assert!(state.z_um > 50.0 && state.current_a[0] > 4e-3);
//!
//! let mut sensor = Sensor::new(&config); // instruments of a measuring session: adds their noise
//! let reading = sensor.read(&state, 2.0);
//! assert!((reading.z_um - state.z_um).abs() < 0.5);
//! # Ok::<(), virtual_mirror::ConfigError>(())
//! ```
//!
//! # What else there is
//! - [`MirrorConfig`]: a TOML file, `mirrors/bench.toml` by default; [`MirrorConfig::paper`] shows every number that the
//!   paper publishes within a tenth ([`PaperNumbers`] measures them; the example `paper_numbers` prints them).
//! - [`Effect`]: physics that is switched on with a strength, in a file's `[effects]` or by
//!   [`MirrorConfig::with_effect`]; 1 is a size that happens.
//! - [`Family`]: random mirrors without effects, by [`MirrorConfig::draw`].
//! - [`Plan`], [`Session`]: a whole measuring session on one mirror, with the instruments' noise, as plain structs.
//!
//! # Conventions
//! - z is the displacement of the plate's centre from its cold rest position, positive towards the substrate (um).
//! - Actuators 1, 2, 3, 4 hold the plate's +x, +y, -x, -y edge.
//! - A drive beyond the rails (`drive_limit_v`) is held at them, NaN counts as 0 V; no output is ever NaN.
//! - The same file, seed and calls give the same numbers to the bit on one platform.
//! - Steps are error-controlled inside: the length of the tick is the caller's choice, not the solver's.

mod build;
pub mod config;
pub mod effects;
pub mod family;
pub mod material;
mod mirror;
mod motion;
pub mod paper;
mod per_actuator;
pub mod plan;
mod sensor;
pub mod session;
mod shape;
mod slow;
mod state;
mod thermal;

pub use config::{ConfigError, MirrorConfig, MotionConfig, Segment};
pub use effects::Effect;
pub use family::Family;
pub use material::{Film, Layer};
pub use mirror::VirtualMirror;
pub use paper::PaperNumbers;
pub use plan::{Dwell, Experiment, Plan};
pub use sensor::{Reading, Sensor};
pub use session::Session;
pub use state::State;
