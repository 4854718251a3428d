//! The whole firmware behind its USB device, as a host sees it. One program, since what is compiled for each is the firmware.

mod calibration;
mod fault_log;
mod lease;
mod stop;
mod uploads;
mod usb;
mod usb_frames;

use embedded_storage::nor_flash::NorFlash;
use firmware_on_host::FLASH_PAGES;
use mirror_firmware::flash::LOG_BYTES;
use simulated_flash::{HalfWords, PAGE_BYTES, SharedFlash, SimulatedFlash};

/// The flash of a board that was never switched on.
fn erased() -> SharedFlash {
    SharedFlash::new(SimulatedFlash::new(FLASH_PAGES, HalfWords::Flicker, 3))
}

/// The flash of a board whose stored calibration is garbage.
fn with_a_bad_calibration() -> SharedFlash {
    let flash = erased();
    let garbage = [0x5a; PAGE_BYTES];
    flash
        .lock()
        .write(LOG_BYTES as u32, &garbage)
        .expect("erased");
    flash
}
