//! The machine that builds the firmware, as a board: for tests of everything above the hardware.
//!
//! Its time is the count of control ticks, and its own in every thread, so that many such boards can
//! run beside each other without a clock.

pub mod flash;
pub mod link;
mod log;
mod time;

use control_core::{AdcCode, Ampere, CHANNELS, PwmCode, SupplyCode};
use embassy_futures::yield_now;

use crate::board::{Board, Lockstep, Sensed};
use crate::control::Control;

/// A board with resistors in the place of a mirror.
#[derive(Debug, Default)]
pub struct HostBoard {
    codes: [PwmCode; CHANNELS],
}

/// About a cold heater's.
const RESISTANCE_OHM: f32 = 360.0;

impl Board for HostBoard {
    const NAME: &'static str = "no board, the firmware on a host";
    const IS_EMULATED: bool = true;
    const BOOTLOADER: Option<fn() -> !> = None;

    fn drive(&mut self, codes: [PwmCode; CHANNELS]) -> bool {
        self.codes = codes;
        true
    }

    fn disable(&mut self) {
        self.codes = [PwmCode(0); CHANNELS];
    }
}

impl Lockstep for HostBoard {
    async fn sense(&mut self, _control: &Control) -> Sensed {
        yield_now().await;
        time::advance();
        let current = |code: PwmCode| Ampere(code.drive().0 / RESISTANCE_OHM);
        Sensed {
            currents: self.codes.map(|code| AdcCode::nearest(current(code))),
            supply: SupplyCode::from_millivolt(5000),
            ..Sensed::default()
        }
    }
}
