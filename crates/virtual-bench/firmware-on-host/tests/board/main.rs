//! The whole firmware behind its USB device, as a host sees it. One program, since what is compiled for each is the firmware.

mod calibration;
mod fault_log;
mod stop;
mod uploads;
mod usb;

use firmware_on_host::FLASH_PAGES;
use simulated_flash::{HalfWords, SharedFlash, SimulatedFlash};

/// The flash of a board that was never switched on.
fn erased() -> SharedFlash {
    SharedFlash::new(SimulatedFlash::new(FLASH_PAGES, HalfWords::Flicker, 3))
}
