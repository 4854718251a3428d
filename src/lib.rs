//! Firmware of the driver board for electrothermal MEMS mirrors.
//!
//! One application on two boards. A command and the control tick that carries it out run through:
//!
//! ```text
//! board/*/link   bytes <-> frames                  (USB, or the emulator's UART)
//! rpc            frames <-> commands and answers   (postcard-rpc)
//! calibration    an uploaded calibration, whole and checked
//! mailbox        orders, and what the last tick did
//! control        one tick: converter codes in, PWM codes out (control-core decides)
//! fault_log      what it remembers of starts and trips
//! board/*        registers
//! ```
#![no_std]

// Provides the critical sections.
#[cfg(target_os = "none")]
use cortex_m as _;

pub mod board;
pub mod calibration;
pub mod control;
mod exchange;
pub mod fault_log;
pub mod flash;
pub mod keeper;
#[cfg(target_os = "none")]
pub mod last_stop;
pub mod mailbox;
pub mod origin;
pub mod resets;
pub mod retained;
pub mod rpc;
pub mod startup;
#[cfg(any(feature = "board-stm32g474", feature = "board-host"))]
pub mod usb;
pub mod watchdog;

#[cfg(any(
    all(feature = "board-stm32g474", feature = "board-mps2"),
    all(feature = "board-stm32g474", feature = "board-host"),
    all(feature = "board-mps2", feature = "board-host"),
))]
compile_error!("choose one board: `board-stm32g474`, `board-mps2` or `board-host`");

/// Control ticks a second, on every board, as the control core has it.
pub const TICK_HZ: u32 = (1.0 / control_core::TICK.0 + 0.5) as u32;

/// Control ticks in a millisecond.
pub const TICKS_PER_MS: u32 = TICK_HZ / 1000;

/// The calibration that a board has before it has been given its own: the inverse of the
/// `reconciled` preset of the model, as `cargo xtask tabulate-factory` tabulates it.
pub mod factory {
    use control_core::Calibration;

    static BYTES: &[u8] = include_bytes!("factory.bin");

    /// The calibration, read as an uploaded one is.
    pub fn calibration() -> Calibration {
        match Calibration::from_bytes(BYTES) {
            Ok(calibration) => calibration,
            Err(_) => panic!("the firmware image is damaged"),
        }
    }
}
