//! The end of an emulated board. Behind a plant it resets, as the driver board does; without one
//! (tests, benchmarks) QEMU must not go on when the firmware cannot.

#![expect(unsafe_code, reason = "the attribute of a fault handler")]

use core::fmt;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};
use mirror_protocol::ResetCause;
use protection::Fault;
use semihosting::process::ExitCode;

use super::watchdog;
use crate::last_stop;
use crate::origin::{LastStop, Origin};
use crate::resets::Resets;
use crate::retained::Keep;

/// Whether there is a plant. At its reset the plant gets zero drive with the first tick.
pub(super) static HAS_PLANT: AtomicBool = AtomicBool::new(false);

/// The plant closed its end, which is how it stops the board.
pub(super) fn plant_lost() -> ! {
    ExitCode::SUCCESS.exit_process()
}

fn stop(fault: Fault, reason: fmt::Arguments<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(&reason));
    if HAS_PLANT.load(Ordering::Relaxed) {
        last_stop::keep(fault, reason);
        cortex_m::peripheral::SCB::sys_reset()
    }
    ExitCode::FAILURE.exit_process()
}

/// How this start came about. The emulator has no register that tells; its memory is empty when it is started.
pub fn origin() -> Origin {
    let resets = Resets::of_the_image();
    let last_stop = last_stop::take();
    let by_watchdog = |stop: &LastStop| stop.fault == Fault::WatchdogReset;
    let cause = match &last_stop {
        _ if !resets.are_kept() => ResetCause::Power,
        Some(stop) if by_watchdog(stop) => ResetCause::Watchdog,
        _ => ResetCause::Firmware,
    };
    Origin {
        cause,
        last_stop,
        resets,
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

#[exception]
unsafe fn NonMaskableInt() {
    if watchdog::has_run_out() {
        stop(
            Fault::WatchdogReset,
            format_args!("a part of the firmware had stopped"),
        )
    }
}
