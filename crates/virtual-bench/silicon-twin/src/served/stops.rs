//! Stops: each byte that a tool writes into a FIFO becomes the vendor request on endpoint 0, and comes back once the
//! device says that a control tick has carried it out (docs, the protocol).

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use board_sockets::stop_fifos;
use rustix::fs::{CWD, Mode, OFlags, mkfifoat};

use crate::usb_host::{Request, UsbHost};

/// A vendor request to the device, in either direction (USB 2.0, table 9-2); its number is the protocol's.
const TO_DEVICE: u8 = 0x40;
const TO_HOST: u8 = 0xc0;
const STOP: u8 = 0x53;

/// The FIFOs, and the stops that wait to be confirmed.
#[derive(Debug)]
pub(super) struct Stops {
    paths: [PathBuf; 2],
    stops: File,
    done: File,
    waiting: Vec<u8>,
}

fn request(kind: u8, length: u16) -> Request {
    Request {
        kind,
        request: STOP,
        value: 0,
        length,
    }
}

impl Stops {
    /// Makes the FIFOs beside a socket.
    pub(super) fn beside(socket: &Path) -> io::Result<Self> {
        let paths = stop_fifos(socket);
        for path in &paths {
            match fs::remove_file(path) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
            mkfifoat(CWD, path, Mode::RUSR | Mode::WUSR)?;
        }
        // Open at both ends, so that tools that come and go do not end it.
        let open = |path: &Path| {
            let flags = OFlags::NONBLOCK.bits() as i32;
            File::options()
                .read(true)
                .write(true)
                .custom_flags(flags)
                .open(path)
        };
        Ok(Self {
            stops: open(&paths[0])?,
            done: open(&paths[1])?,
            paths,
            waiting: Vec::new(),
        })
    }

    /// Hands new stops to the device, asks for those that wait, and tells those that are done.
    pub(super) fn exchange(&mut self, host: &mut UsbHost) {
        let mut marks = [0; 64];
        if let Ok(got) = self.stops.read(&mut marks) {
            if self.waiting.is_empty() {
                host.request(request(TO_DEVICE, 0));
                host.request(request(TO_HOST, 1));
            }
            self.waiting.extend(&marks[..got]);
        }
        while let Some((answered, data)) = host.answer() {
            if answered != request(TO_HOST, 1) {
                continue;
            }
            match data.as_deref() {
                Some([0]) => host.request(request(TO_HOST, 1)),
                // A tool that has gone reads nothing.
                Some(_) => drop(self.done.write(&std::mem::take(&mut self.waiting))),
                None => self.waiting.clear(),
            }
        }
    }
}

impl Drop for Stops {
    fn drop(&mut self) {
        for path in &self.paths {
            let _ = fs::remove_file(path);
        }
    }
}
