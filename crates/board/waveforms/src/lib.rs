//! What a board does by itself, tick by tick, because its link to the host is too slow for it: a
//! [`Waveform`] of setpoints goes out, and samples come back where a [`Stream`] asks for them.
//!
//! No hardware, no clock: a [`Player`] and a [`Sampler`] are called once a control tick.
#![no_std]

#[cfg(test)]
extern crate std;

mod mean;
mod player;
mod sampler;
mod sampling;
mod setpoint;
mod turn;
mod waveform;

pub use player::{Played, Player};
pub use sampler::{Reading, Sampler};
pub use sampling::{Due, Pacer, Stream};
pub use waveform::{
    Curve, FULL_SCALE, Flaw, POINTS, POSE_POINTS, Quantity, Shape, Table, Tilt, Trigger, Triggers,
    Waveform,
};
