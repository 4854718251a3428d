//! Linux and macOS.

use std::fs::{File, FileType, OpenOptions};
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{Mode, OFlags, open};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use tokio::signal::unix::{Signal, SignalKind, signal};

/// Ctrl-C, and SIGTERM, by which a service manager or `timeout` ends a program: neither ends the process by itself any longer. SIGHUP does: who
/// began the tool with `nohup` has it ignored.
pub(crate) struct Interrupts {
    interrupt: Signal,
    terminate: Signal,
}

impl Interrupts {
    /// From now on.
    pub(crate) fn listen() -> io::Result<Self> {
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
        })
    }

    /// Waits for the next one; `false` where there will be none.
    pub(crate) async fn next(&mut self) -> bool {
        let heard = tokio::select! {
            heard = self.interrupt.recv() => heard,
            heard = self.terminate.recv() => heard,
        };
        heard.is_some()
    }
}

/// Waits for a signal that ends the tool, and returns its name and number.
pub(crate) async fn ended_by_signal() -> io::Result<(&'static str, u8)> {
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    Ok(tokio::select! {
        _ = interrupt.recv() => ("SIGINT", 2),
        _ = terminate.recv() => ("SIGTERM", 15),
        _ = hang_up.recv() => ("SIGHUP", 1),
    })
}

/// A file of the user's own: nobody else reads it, and another's link in its place is not followed.
pub(crate) fn private_file() -> OpenOptions {
    let mut options = File::options();
    let flags = OFlags::NOFOLLOW.bits();
    options.read(true).write(true).mode(0o600);
    options.custom_flags(flags.cast_signed());
    options
}

/// The standard output as a file, in which no line waits for its end.
pub(crate) fn standard_output() -> io::Result<File> {
    io::stdout().as_fd().try_clone_to_owned().map(File::from)
}

/// Whether bytes come out of it as they arrive: a serial device, or a FIFO.
pub(crate) fn is_device(kind: FileType) -> bool {
    kind.is_char_device() || kind.is_fifo()
}

/// Opens a serial device, or a FIFO, at a speed of so many baud; without one it keeps its own.
///
/// A terminal is made to hand on what arrives as it is: nothing is echoed to the sensor, no character is a signal, and the
/// device does not become the terminal that this process belongs to.
pub(crate) fn serial_device(path: &Path, baud: Option<u32>) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::NOCTTY | OFlags::CLOEXEC;
    let device = File::from(open(path, flags, Mode::empty())?);
    if device.is_terminal() {
        let mut modes = tcgetattr(&device)?;
        modes.make_raw();
        if let Some(baud) = baud {
            modes.set_speed(baud)?;
        }
        tcsetattr(&device, OptionalActions::Flush, &modes)?;
    }
    Ok(device)
}
