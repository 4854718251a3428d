//! The CMSDK watchdog (ARM DDI 0479, section 4.5). It counts real time: where the firmware hangs,
//! simulated time stands still.

#![expect(unsafe_code, reason = "the watchdog's registers")]

const WATCHDOG: usize = 0x4000_8000;
const LOAD: usize = WATCHDOG;
const CONTROL: usize = WATCHDOG + 0x08;
const INTERRUPT_CLEAR: usize = WATCHDOG + 0x0c;

/// Counts of 25 MHz: 5 s. A busy machine may keep the plant waiting for a while.
const TIMEOUT: u32 = 5 * 25_000_000;
/// Interrupt, which is the processor's NMI, at the first time-out; reset at the second.
const ENABLE: u32 = 0b11;

/// Starts the watchdog.
pub fn start() {
    write(LOAD, TIMEOUT);
    write(CONTROL, ENABLE);
}

/// Lets it count anew.
pub fn feed() {
    write(INTERRUPT_CLEAR, 1);
}

fn write(register: usize, value: u32) {
    // SAFETY: a register of the watchdog, aligned, owned by this module.
    unsafe { (register as *mut u32).write_volatile(value) }
}
