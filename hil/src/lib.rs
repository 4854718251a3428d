//! The bench that the acceptance checks run on: a board, and the tool in front of it.
//!
//! `MIRROR_BOARD` names a real board, or an emulated one that runs already; without it every check
//! gets an emulated board of its own. `cargo xtask hil` and `cargo xtask test` set it all up.

mod bench;
mod disturb;
mod emulated;
mod emulator;
mod patience;
mod processor;
mod raw;
mod terminal;

pub use bench::{Bench, Said, is_on_twin};
pub use disturb::{DISTURBANCES, Disturbance};
pub use processor::processor_s;
pub use raw::RawLink;
pub use terminal::Terminal;

/// Interrupts a tool as Ctrl-C does.
///
/// # Panics
/// Where it has ended.
pub fn interrupt(tool: &std::process::Child) {
    signal(tool, "INT");
}

/// Sends a tool the signal of this name.
///
/// # Panics
/// Where it has ended.
pub fn signal(tool: &std::process::Child, name: &str) {
    let id = tool.id().to_string();
    let sent = std::process::Command::new("kill")
        .args(["-s", name, &id])
        .status();
    assert!(sent.expect("`kill` runs").success(), "it has ended");
}
