//! The machine that builds the firmware, as a board.
//!
//! Its time is the count of control ticks, and its own in every thread, so that many such boards can
//! run beside each other without a clock.

pub mod flash;
pub mod link;
mod log;
mod plant;
mod time;

pub use plant::{Plant, PlantCall};

/// A board whose plant is called.
pub type HostBoard = super::lockstep::LockstepBoard<PlantCall>;
