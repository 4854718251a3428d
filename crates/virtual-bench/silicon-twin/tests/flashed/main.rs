//! The flashed image on the silicon twin, with a tool in the same process.

mod bootloader;
mod common;
mod power_cuts;
