//! Windows, for which this is compiled and on which nobody has run it: no emulated boards, no serial sensors, and files are as private
//! as the folders that they are in.

use std::fs::{File, FileType, OpenOptions};
use std::io;
use std::os::windows::io::AsHandle;
use std::path::Path;

use tokio::signal::windows::{CtrlBreak, CtrlC, ctrl_break, ctrl_c, ctrl_close};

/// Ctrl-C and Ctrl-Break, which no longer end the process by themselves.
pub(crate) struct Interrupts {
    interrupt: CtrlC,
    stop: CtrlBreak,
}

impl Interrupts {
    /// From now on.
    pub(crate) fn listen() -> io::Result<Self> {
        Ok(Self {
            interrupt: ctrl_c()?,
            stop: ctrl_break()?,
        })
    }

    /// Waits for the next one; `false` where there will be none.
    pub(crate) async fn next(&mut self) -> bool {
        let heard = tokio::select! {
            heard = self.interrupt.recv() => heard,
            heard = self.stop.recv() => heard,
        };
        heard.is_some()
    }
}

/// Waits for an event that ends the tool, and returns its name and the number of the signal that it stands for elsewhere.
pub(crate) async fn ended_by_signal() -> io::Result<(&'static str, u8)> {
    let (mut interrupt, mut stop, mut close) = (ctrl_c()?, ctrl_break()?, ctrl_close()?);
    Ok(tokio::select! {
        _ = interrupt.recv() => ("Ctrl-C", 2),
        _ = stop.recv() => ("Ctrl-Break", 15),
        _ = close.recv() => ("the end of its terminal", 1),
    })
}

/// A file in a folder of the user's own.
pub(crate) fn private_file() -> OpenOptions {
    let mut options = File::options();
    options.read(true).write(true);
    options
}

/// The standard output as a file, in which no line waits for its end.
pub(crate) fn standard_output() -> io::Result<File> {
    io::stdout()
        .as_handle()
        .try_clone_to_owned()
        .map(File::from)
}

/// Whether bytes come out of it as they arrive: no file that has a type does so here.
pub(crate) fn is_device(_: FileType) -> bool {
    false
}

/// Serial devices are not opened here.
pub(crate) fn serial_device(_: &Path, _: Option<u32>) -> io::Result<File> {
    Err(io::ErrorKind::Unsupported.into())
}
