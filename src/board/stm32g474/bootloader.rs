//! The way to the bootloader in the ROM, which takes new firmware over USB (AN2606, AN3156).
//!
//! It expects the processor as a reset leaves it. So a request is noted in memory that no start
//! clears, the processor is reset, and the next start goes to the ROM before anything else.

#![expect(unsafe_code, reason = "memory that outlives a reset, and the jump")]

use core::mem::MaybeUninit;

use cortex_m::peripheral::SCB;
use embassy_stm32::pac;

/// Where the ROM begins, with its vectors.
const ROM: *const u32 = 0x1fff_0000 as *const u32;

/// The ROM seen at address 0 (RM0440, SYSCFG_MEMRMP).
const MEMORY_MODE_ROM: u8 = 1;

/// Stands for a request; anything else is what the memory happened to hold.
const REQUESTED: u32 = 0x626f_6f74;

#[unsafe(link_section = ".uninit.BOOTLOADER_REQUEST")]
static mut REQUEST: MaybeUninit<u32> = MaybeUninit::uninit();

/// Leaves for the bootloader. The outputs are turned off first, and stay so.
pub(super) fn enter(turn_outputs_off: fn()) -> ! {
    cortex_m::interrupt::disable();
    turn_outputs_off();
    // SAFETY: nothing else touches it, and interrupts are off.
    unsafe { (&raw mut REQUEST).write_volatile(MaybeUninit::new(REQUESTED)) };
    SCB::sys_reset()
}

/// Goes to the bootloader if that was requested before the reset. Call it before anything is set up.
pub fn enter_if_requested() {
    // SAFETY: any bits are a number, and nothing else touches it.
    let request = unsafe { (&raw mut REQUEST).cast::<u32>().read_volatile() };
    // SAFETY: as above. Once only: the next reset starts the program.
    unsafe { (&raw mut REQUEST).write_volatile(MaybeUninit::new(0)) };
    if request == REQUESTED {
        pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
        pac::SYSCFG
            .memrmp()
            .modify(|w| w.set_mem_mode(MEMORY_MODE_ROM));
        // SAFETY: the ROM's vectors are there, and the processor is as the reset left it.
        unsafe { cortex_m::asm::bootload(ROM) }
    }
}
