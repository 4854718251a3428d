//! The driver board without hardware.
//!
//! The firmware runs in QEMU on an emulated Cortex-M4F. At every control tick it sends the compare
//! values of its PWM to a [`Plant`], the board's [`Electronics`] with a virtual mirror on them, and
//! waits for what its converters read; so simulated time is the count of control ticks. What
//! the two say to each other repeats to the bit; the tick at which a command arrives is the host's. The host reaches the board through a socket, as it would reach a real one
//! through USB.

mod board;
mod controls;
mod electronics;
mod faults;
mod logs;
mod mirror;
mod pace;
mod place;
mod plant;
mod qemu;
mod stack;
mod start_error;
mod stop_fifos;
mod tool_link;

pub use board::{EmulatedBoard, Emulation};
pub use controls::{Controls, Counted, Surroundings};
pub use electronics::{Electronics, Rail, is_over_voltage};
pub use faults::{Observed, PlantFault, Upset};
pub use logs::{LogError, LogTable};
pub use mirror::{Device, Mirror};
pub use pace::{NoSpeed, Pace, Speed, Traffic};
pub use place::{FlashClaim, claim_socket, private_directory};
pub use plant::{Connected, Load, Plant, Progress};
pub use qemu::{MACHINE_ARGUMENTS, QEMU};
pub use stack::Stack;
pub use start_error::StartError;
pub use stop_fifos::StopFifos;
pub use tool_link::ToolLink;
