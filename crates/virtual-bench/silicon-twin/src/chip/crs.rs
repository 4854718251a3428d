//! Clock recovery: HSI48 is trimmed by the host's frames (RM0440, chapter 8). The oscillator of the model is exact, so
//! there is nothing to trim; that it is set up as USB needs it is checked.

use super::refused::{Access, Refused, misuse};

/// CR: trimming by itself, and counting.
const AUTOTRIMEN: u32 = 1 << 6;
const CEN: u32 = 1 << 5;
/// CFGR as after reset: 48 MHz in frames of 1 ms, synchronised by USB.
const CFGR_RESET: u32 = 0x2022_bb7f;
const SYNC_SOURCE: u32 = 0b11 << 28;
const SYNC_USB: u32 = 0b10 << 28;

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Crs {
    cr: u32,
    cfgr: u32,
}

impl Crs {
    pub(crate) fn new() -> Self {
        Self {
            cr: 0x4000,
            cfgr: CFGR_RESET,
        }
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        match at {
            0x00 => Ok(self.cr),
            0x04 => Ok(self.cfgr),
            _ => Err(Refused::NotModelled),
        }
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            0x00 => self.cr = value & 0x7fff,
            0x04 if self.cr & CEN != 0 => {
                return misuse(
                    "CRS.CFGR is written while the counter runs (RM0440, section 8.7.2)",
                );
            }
            0x04 => self.cfgr = value,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    /// USB needs 0.25 % (USB 2.0, section 7.1.11), and HSI48 has 3 % (DS12288, table 53) unless it is trimmed.
    pub(crate) fn check_for_usb(&self) -> Access {
        let is_trimmed = self.cr & (AUTOTRIMEN | CEN) == AUTOTRIMEN | CEN;
        match is_trimmed && self.cfgr & SYNC_SOURCE == SYNC_USB {
            true => Ok(()),
            false => misuse("USB runs from HSI48, which nothing trims (RM0440, section 8.3)"),
        }
    }
}
