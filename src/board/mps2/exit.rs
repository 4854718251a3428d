//! The end of an emulated board: QEMU must not go on when the firmware cannot.

#![expect(unsafe_code, reason = "the attribute of a fault handler")]

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use semihosting::process::ExitCode;

/// The plant closed its end, which is how it stops the board.
pub(super) fn plant_lost() -> ! {
    ExitCode::SUCCESS.exit_process()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    ExitCode::FAILURE.exit_process()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!("HardFault at {=u32:#010x}", frame.pc());
    ExitCode::FAILURE.exit_process()
}
