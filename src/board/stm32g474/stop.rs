//! What happens when the firmware cannot go on: the outputs first.

#![expect(unsafe_code, reason = "the attribute of a fault handler")]

use core::fmt;
use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;
use protection::Fault;

use crate::last_stop;
use crate::startup::LastStop;

/// Turns the four outputs off in the timer's own registers, keeps the reason, and starts anew.
pub(super) fn stop(fault: Fault, reason: fmt::Arguments<'_>) -> ! {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    last_stop::keep(fault, reason);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Why the firmware stopped before this start, if it did: what it left, or the watchdog's reset.
pub fn last_stop() -> Option<LastStop> {
    let by_watchdog = pac::RCC.csr().read().iwdgrstf();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    last_stop::take().or_else(|| {
        by_watchdog.then(|| LastStop {
            fault: Fault::WatchdogReset,
            text: Default::default(),
        })
    })
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    stop(Fault::FirmwarePanic, format_args!("{info}"))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop(Fault::HardFault, format_args!("at {:#010x}", frame.pc()))
}
