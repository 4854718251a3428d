//! What happens when the firmware cannot go on: the outputs first.

#![expect(unsafe_code, reason = "the attribute of a fault handler")]

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;

/// Turns the four outputs off in the timer's own registers, and starts anew.
pub(super) fn stop() -> ! {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(_info: &PanicInfo) -> ! {
    stop()
}

#[exception]
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    stop()
}
