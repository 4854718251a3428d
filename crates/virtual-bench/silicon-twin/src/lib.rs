//! The driver board at register level.
//!
//! The image that is written into a board runs here byte for byte, on a model of the STM32G474RE: processor, clocks,
//! timers, converters, flash. What the chip drives goes to the board's electronics with a virtual mirror on them, and
//! what its converters read comes from there. Nothing depends on the machine's clock, so two runs are the same.
//!
//! Register maps are those of ST (`stm32-metapac`); behaviour is that of RM0440, with its section beside it. An access to
//! a register that is not modelled ends the run, and so does a use of the chip outside its limits.

pub mod board;
pub mod chip;
pub mod coverage;
pub mod cpu;
mod image;
mod names;
pub mod profile;
mod rtt;
pub mod served;
pub mod timing;
pub mod tool;
mod twin;
pub mod usb_host;

pub use image::{Image, ImageError, flashed_image};
pub use twin::{Failure, IN_BOOTLOADER, Twin};
