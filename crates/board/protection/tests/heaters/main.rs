//! The protection in front of four heaters, sound ones and broken ones.

mod bench;
mod glitches;
mod properties;
mod starts;
mod trips;
