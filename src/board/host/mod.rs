//! The machine that builds the firmware, as a board: for tests of everything above the hardware.
//!
//! Its time is the count of control ticks, and its own in every thread, so that many such boards can
//! run beside each other without a clock.

pub mod flash;
pub mod link;
mod log;
mod time;

use control_core::{LANES, PwmCode};
use embassy_futures::yield_now;

use crate::board::{Board, Sensed};

/// A board without a mirror.
#[derive(Debug, Default)]
pub struct HostBoard;

impl Board for HostBoard {
    const NAME: &'static str = "no board, the firmware on a host";
    const IS_EMULATED: bool = true;

    async fn sense(&mut self) -> Sensed {
        yield_now().await;
        time::advance();
        Sensed::default()
    }

    fn drive(&mut self, _codes: [PwmCode; LANES]) {}
}
