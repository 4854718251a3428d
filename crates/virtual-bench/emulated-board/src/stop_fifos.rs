//! The FIFOs by which a board that runs in this process is stopped, whoever holds its socket.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use board_sockets::stop_fifos;
use rustix::fs::{CWD, Mode, OFlags, mkfifoat};

/// Most stops that are taken at once; others wait in the FIFO.
const MOST: usize = 64;

/// The FIFOs, which go when this is dropped.
#[derive(Debug)]
pub struct StopFifos {
    paths: [PathBuf; 2],
    stops: File,
    done: File,
}

impl StopFifos {
    /// Makes them beside a socket.
    ///
    /// # Errors
    /// Where the system makes none.
    pub fn beside(socket: &Path) -> io::Result<Self> {
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
        })
    }

    /// The stops that were asked for since, each a byte.
    pub fn take(&mut self) -> Vec<u8> {
        let mut marks = [0; MOST];
        let got = self.stops.read(&mut marks).unwrap_or(0);
        marks[..got].to_vec()
    }

    /// Tells that these are carried out. A tool that has gone reads nothing.
    pub fn tell(&mut self, marks: &[u8]) {
        let _ = self.done.write(marks);
    }
}

impl Drop for StopFifos {
    fn drop(&mut self) {
        for path in &self.paths {
            let _ = fs::remove_file(path);
        }
    }
}
