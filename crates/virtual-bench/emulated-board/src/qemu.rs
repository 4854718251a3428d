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

/// Becomes the program that its arguments name, whose files and sockets are the user's alone: QEMU's sockets
/// would follow the umask, with which another user could command the board.
const PRIVATELY: &str = r#"umask 077; exec "$0" "$@""#;

/// How a shell ends that does not find the program which it is to become (POSIX.1-2017, 2.8.2).
pub(crate) const NOT_FOUND: i32 = 127;

/// An emulator that runs `image` in `directory`, UART0 on the socket `socket`, UART1 on the FIFOs beside it,
/// semihosting on its standard output; with its monitor on a socket in `directory` where that is wanted.
pub(crate) fn command(image: &Path, directory: &Path, socket: &Path, has_monitor: bool) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", PRIVATELY, QEMU])
        .args(MACHINE_ARGUMENTS)
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-serial")
        .arg(format!("unix:{},server=on,wait=off", socket.display()))
        .arg("-serial")
        // QEMU adds `.in` and `.out` to this name (`board_sockets::stop_fifos`).
        .arg(format!("pipe:{}", socket.with_extension("stop").display()))
        .arg("-kernel")
        .arg(image)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if has_monitor {
        let monitor = format!("unix:{MONITOR},server=on,wait=off");
        command.arg("-qmp").arg(monitor);
    }
    command
}
