//! ST's bootloader in the ROM, as far as a program meets it: its vectors, and what it leaves behind when it goes to a program
//! that it has written (AN2606, STM32G47xxx/48xxx; AN3156, leaving the DFU mode). What it does in between is not modelled.

use super::refused::Access;
use super::{Chip, RESET_HZ, address};

/// Where it is (RM0440, section 2.2).
pub(crate) const ROM: u32 = 0x1fff_0000;
pub(super) const ROM_END: u32 = 0x1fff_7000;
/// Its vectors: a stack, and where the second of them leads.
const STACK: u32 = 0x2000_4000;
const ENTRY: u32 = ROM + 0x101;

/// Longer than any clock takes to start.
const CLOCKS_START_S: f64 = 1e-3;

/// A word of the ROM that programs read.
pub(super) fn word(address: u32) -> Option<u32> {
    match address {
        ROM => Some(STACK),
        _ if address == ROM + 4 => Some(ENTRY),
        _ => None,
    }
}

impl Chip {
    /// The clocks as the ROM has them while it serves USB: 72 MHz from HSI16 by the PLL, HSI48 for USB, trimmed by the frames;
    /// and the memory that it has used.
    pub(crate) fn leave_rom(&mut self) -> Access {
        // HSI16 / 4 * 36 / 2, with the wait states of that in range 1.
        let pll = 36 << 8 | 3 << 4 | 0b10 | 1 << 24;
        for (at, value) in [
            (address::FLASH, 0x0004_0600 | 2),
            (address::RCC + 0x0c, pll),
            (address::RCC, 1 << 24 | 1 << 8),
            (address::RCC + 0x98, 1),
            // GPIOA; PWR, USB and CRS; SYSCFG, with the ROM seen at address 0.
            (address::RCC + 0x4c, 1),
            (address::RCC + 0x58, 1 << 28 | 1 << 23 | 1 << 8),
            (address::RCC + 0x60, 1),
            (address::SYSCFG, 1),
            (address::CRS, 0x4000 | 1 << 6 | 1 << 5),
        ] {
            self.write_register(at, value)?;
        }
        self.clock.cycles += (CLOCKS_START_S * RESET_HZ) as u64;
        self.advance();
        self.write_register(address::RCC + 0x08, 0b11)?;
        self.next_event = 0;
        Ok(())
    }
}
