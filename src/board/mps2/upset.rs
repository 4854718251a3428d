//! Disturbances of the processor, which the plant asks for in tests.

#![expect(unsafe_code, reason = "an access that faults")]

use plant_link::upset;

/// Nothing is there, and a read from there faults.
const NOWHERE: *const u32 = 0xf000_0000 as *const u32;

/// Does to the processor what a disturbance would.
pub(super) fn suffer(disturbance: u8) {
    match disturbance {
        upset::PANIC => panic!("on purpose"),
        // SAFETY: the access is meant to fault.
        upset::HARD_FAULT => drop(unsafe { NOWHERE.read_volatile() }),
        upset::HANG => loop {
            cortex_m::asm::nop();
        },
        upset::RESET => cortex_m::peripheral::SCB::sys_reset(),
        _ => {}
    }
}
