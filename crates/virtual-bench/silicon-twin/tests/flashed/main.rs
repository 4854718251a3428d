//! The flashed image on the silicon twin, with a tool in the same process.

mod bootloader;
mod common;
mod fuzz;
mod glitches;
mod late;
mod power_cuts;
mod stops;
mod timing;
mod worn;
