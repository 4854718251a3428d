//! What happens when the firmware cannot go on: the outputs first.

#![expect(unsafe_code, reason = "the attribute of a fault handler")]

use core::fmt;
use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;
use mirror_protocol::ResetCause;
use protection::Fault;

use super::converters::turn_outputs_off;
use crate::last_stop;
use crate::origin::{LastStop, Origin};
use crate::resets::Resets;
use crate::retained::Keep;

/// Turns the four outputs off, keeps the reason, and starts anew.
pub(super) fn stop(fault: Fault, reason: fmt::Arguments<'_>) -> ! {
    turn_outputs_off();
    last_stop::keep(fault, reason);
    cortex_m::peripheral::SCB::sys_reset()
}

/// How this start came about: what the firmware left when it stopped, and the flags of the reset (RM0440, RCC_CSR).
pub fn origin() -> Origin {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset pulls the pin too, so that its flag means something where it is alone.
    let causes = [
        (flags.iwdgrstf(), ResetCause::Watchdog),
        (flags.sftrstf(), ResetCause::Firmware),
        (flags.oblrstf(), ResetCause::OptionBytes),
        (flags.borrstf(), ResetCause::Power),
        (flags.wwdgrstf() || flags.lpwrrstf(), ResetCause::Other),
        (flags.pinrstf(), ResetCause::Pin),
    ];
    let cause = causes.into_iter().find(|(is_it, _)| *is_it);
    let cause = cause.map_or(ResetCause::Other, |(_, cause)| cause);
    let last_stop = last_stop::take().or_else(|| {
        (cause == ResetCause::Watchdog).then(|| LastStop {
            fault: Fault::WatchdogReset,
            text: Default::default(),
        })
    });
    Origin {
        cause,
        last_stop,
        resets: Resets::of_the_image(),
        retained: Keep::of_the_image(),
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    stop(Fault::FirmwarePanic, format_args!("{info}"))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop(Fault::HardFault, format_args!("at {:#010x}", frame.pc()))
}
