//! The protection in front of four heaters, sound ones and broken ones.

mod bench;
#[path = "../common/mod.rs"]
mod common;
mod glitches;
mod properties;
mod starts;
mod trips;
