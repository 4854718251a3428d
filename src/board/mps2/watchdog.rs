//! The CMSDK watchdog (ARM DDI 0479, section 4.5), which goes by the emulator's processor time.
//!
//! It cannot go by simulated time, which stands still where the firmware hangs. Nor by the host's, which passes
//! while the plant keeps the board waiting, or a busy machine gives the emulator no processor: that is no fault
//! of the firmware. A firmware that hangs uses the processor, one that waits or is kept from running does not.

#![expect(unsafe_code, reason = "the watchdog's registers")]

use core::sync::atomic::{AtomicU32, Ordering};

use semihosting::sys::arm_compat::sys_clock;

const WATCHDOG: usize = 0x4000_8000;
const LOAD: usize = WATCHDOG;
const CONTROL: usize = WATCHDOG + 0x08;
const INTERRUPT_CLEAR: usize = WATCHDOG + 0x0c;

/// Counts of 25 MHz: a quarter of a second of the host's time from one look at the processor time to the next.
const LOOK: u32 = 25_000_000 / 4;
/// Only the interrupt, which is the processor's NMI, and not the reset at a second time-out: that would come by
/// the host's time.
const ENABLE: u32 = 0b01;

/// Hundredths of a second of processor time, semihosting's unit: 1 s. From one feeding to the next the emulator
/// uses some 10 ms.
const PATIENCE: u32 = 100;

/// It was fed since it looked last.
const FED: u32 = u32::MAX;
/// The processor time of the first look since it was fed.
static UNFED_SINCE: AtomicU32 = AtomicU32::new(FED);

/// Starts the watchdog.
pub fn start() {
    count_anew();
    write(CONTROL, ENABLE);
}

/// Lets it count anew.
pub fn feed() {
    UNFED_SINCE.store(FED, Ordering::Relaxed);
    count_anew();
}

/// The interrupt is cleared, and the counter loaded: at a second time-out before that the counter stops for good, reset or
/// none, and only a load starts it again. On a starved host both time-outs come before an instruction does.
fn count_anew() {
    write(LOAD, LOOK);
    write(INTERRUPT_CLEAR, 1);
}

/// Looks at the processor time: whether the firmware has used [`PATIENCE`] of it unfed.
pub(super) fn has_run_out() -> bool {
    count_anew();
    let Ok(now) = sys_clock() else {
        return true;
    };
    let now = now as u32;
    match UNFED_SINCE.load(Ordering::Relaxed) {
        FED => {
            UNFED_SINCE.store(now, Ordering::Relaxed);
            false
        }
        since => now.wrapping_sub(since) >= PATIENCE,
    }
}

fn write(register: usize, value: u32) {
    // SAFETY: a register of the watchdog, aligned, owned by this module.
    unsafe { (register as *mut u32).write_volatile(value) }
}
