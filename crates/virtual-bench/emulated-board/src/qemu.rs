//! The emulator's command line.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::stack::MONITOR;

/// The emulator's program.
pub const QEMU: &str = "qemu-system-arm";

/// The machine, without anything attached.
pub const MACHINE_ARGUMENTS: [&str; 8] = [
    "-machine",
    "mps2-an386",
    "-cpu",
    "cortex-m4",
    "-display",
    "none",
    "-monitor",
    "none",
];

/// An emulator that runs `image` in `directory`, UART0 on the socket `socket` there, semihosting on
/// its standard output.
pub(crate) fn command(image: &Path, directory: &Path, socket: &Path) -> Command {
    let mut command = Command::new(QEMU);
    command
        .args(MACHINE_ARGUMENTS)
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-serial")
        .arg(format!("unix:{},server=on,wait=off", socket.display()))
        .arg("-qmp")
        .arg(format!("unix:{MONITOR},server=on,wait=off"))
        .arg("-kernel")
        .arg(image)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}
