//! The top 48 KB of the second flash bank, for the fault log and calibrations.
//!
//! Programs run from the first bank, so the processor, and the control loop with it, goes on while the
//! second is erased (22 ms a page) or written. That takes the dual-bank mode in which these chips are
//! delivered.

#![expect(unsafe_code, reason = "the attribute of an exception handler")]

use cortex_m_rt::exception;
use embassy_stm32::flash::{self, Blocking, Flash};
use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::peripherals::FLASH;
use embassy_stm32::{Peri, pac};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use protection::Fault;

use super::stop::stop;
use crate::flash::FLASH_BYTES;

/// Where it lies, from the start of the flash. `memory.x` keeps programs out of it.
const START: u32 = 512 * 1024 - FLASH_BYTES as u32;

/// What outlives a reset.
pub struct BoardFlash(Flash<'static, Blocking>);

impl BoardFlash {
    /// `None` where the chip was set to single-bank mode, whose pages lie elsewhere.
    pub fn open(flash: Peri<'static, FLASH>) -> Option<Self> {
        let is_dual_bank = pac::FLASH.optr().read().dbank();
        is_dual_bank.then(|| Self(Flash::new_blocking(flash)))
    }
}

impl ErrorType for BoardFlash {
    type Error = flash::Error;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = flash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), flash::Error> {
        self.0.blocking_read(START + offset, bytes)
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = flash::WRITE_SIZE;
    const ERASE_SIZE: usize = flash::MAX_ERASE_SIZE;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), flash::Error> {
        self.0.blocking_write(START + offset, bytes)
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), flash::Error> {
        // A store that passes over worn slots takes longer than the watchdog waits, and nothing else of the link runs
        // meanwhile. Each page is progress, and there are 24.
        pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
        self.0.blocking_erase(START + from, START + to)
    }
}

/// A word that was half written when the power went has two bits wrong for the error correction, and reading it
/// ends here (RM0440, section 5.3.2). In the second bank it is acknowledged, and the CRC of the
/// record or entry tells.
///
/// The barrier lets the flag fall before this returns, or the processor comes here once more, without a flag. That
/// is no reason to stop: the reset would read the same word again, for ever.
#[exception]
unsafe fn NonMaskableInt() {
    let eccr = pac::FLASH.eccr();
    let error = eccr.read();
    if (error.eccd() || error.eccd2()) && !error.bk_ecc() {
        stop(
            Fault::HardFault,
            format_args!("a word of the program in flash is damaged"),
        );
    }
    // Writing a flag clears it; the clock security system is not in use (RM0440, NMI sources).
    eccr.modify(|w| {
        w.set_eccd(error.eccd());
        w.set_eccd2(error.eccd2());
    });
    cortex_m::asm::dsb();
}
