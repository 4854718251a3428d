//! New firmware for a board, through the bootloader in its microcontroller's ROM, which nothing can
//! overwrite.

pub mod dfuse;
pub mod image;
pub mod package;
pub mod target;
mod usb;

pub use usb::{UsbBootloader, bootloaders};
