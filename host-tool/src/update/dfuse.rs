//! ST's variant of DFU (AN3156), as the bootloader in the ROM of an STM32 speaks it.
//!
//! The order of an update is what makes it safe against a power cut: the first page is erased first,
//! and its first word, stack and entry of the program, is written last, after everything else has been
//! read back. In between, the processor finds nothing to begin with, and the outputs stay off.

use std::time::Duration;

use super::image::Image;

/// Bytes that are erased together in dual-bank mode; in single-bank mode twice as many, which is why
/// everything is erased before anything is written.
const PAGE_BYTES: usize = 2048;
/// The first word of the flash, which is written whole or not at all: stack and entry.
const ENTRY_BYTES: usize = 8;
/// Bytes of one transfer.
const BLOCK_BYTES: usize = 2048;

const DNLOAD: u8 = 1;
const UPLOAD: u8 = 2;
const GETSTATUS: u8 = 3;
const CLRSTATUS: u8 = 4;
const ABORT: u8 = 6;

const SET_ADDRESS: u8 = 0x21;
const ERASE: u8 = 0x41;
/// Block number of commands, and of the first block of data.
const COMMAND: u16 = 0;
const DATA: u16 = 2;

const STATE_IDLE: u8 = 2;
const STATE_BUSY: u8 = 4;
const STATE_DOWNLOAD_IDLE: u8 = 5;
const STATE_ERROR: u8 = 10;

/// How often a busy bootloader is asked; an erasure takes 22 ms, and it names its own pauses.
const POLLS: usize = 200;

/// A device that takes DFU's control requests, to its one interface.
pub trait Bootloader {
    /// Sends `data`.
    ///
    /// # Errors
    /// Where the device refuses, or is gone.
    fn write(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), Gone>;

    /// Fetches up to `length` bytes.
    ///
    /// # Errors
    /// Where the device refuses, or is gone.
    fn read(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, Gone>;

    /// Waits as long as the device asks for.
    fn pause(&mut self, time: Duration);
}

/// The device refused a request, or is gone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gone(pub String);

/// Why an update failed. The board is in its bootloader, and takes another.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UpdateError {
    /// The device is gone.
    #[error("it did not take a request: {0}")]
    Gone(String),
    /// It says that something went wrong.
    #[error("it reported an error (status {status}) at {address:#010x}")]
    Status {
        /// DFU's status.
        status: u8,
        /// The address that was worked on.
        address: u32,
    },
    /// It stays busy, or is in a state that makes no sense.
    #[error("it is stuck in state {state}")]
    Stuck {
        /// DFU's state.
        state: u8,
    },
    /// It reads back other bytes than were written.
    #[error("its flash does not hold what was written, at {address:#010x}")]
    Verify {
        /// Where.
        address: u32,
    },
}

impl From<Gone> for UpdateError {
    fn from(Gone(reason): Gone) -> Self {
        Self::Gone(reason)
    }
}

/// Writes `image`, reads it back, and starts it; `progress` is told how many of the image's bytes are
/// written.
///
/// # Errors
/// Where the bootloader does not do as it is told; it can be told again.
pub fn update(
    device: &mut impl Bootloader,
    image: &Image,
    mut progress: impl FnMut(usize),
) -> Result<(), UpdateError> {
    let mut session = DfuSession { device };
    session.make_idle()?;
    let pages = image.bytes().len().div_ceil(PAGE_BYTES);
    for page in (Image::START..).step_by(PAGE_BYTES).take(pages) {
        session.command(ERASE, page)?;
    }
    let (entry, body) = image.bytes().split_at(ENTRY_BYTES);
    let blocks = || {
        (Image::START + ENTRY_BYTES as u32..)
            .step_by(BLOCK_BYTES)
            .zip(body.chunks(BLOCK_BYTES))
    };
    let mut written = 0;
    for (address, block) in blocks() {
        session.write(address, block)?;
        written += block.len();
        progress(written);
    }
    for (address, block) in blocks() {
        session.verify(address, block)?;
    }
    session.write(Image::START, entry)?;
    session.verify(Image::START, entry)?;
    progress(image.bytes().len());
    session.start()
}

struct DfuSession<'a, D> {
    device: &'a mut D,
}

/// What the device says of itself.
struct DfuStatus {
    status: u8,
    pause: Duration,
    state: u8,
}

impl<D: Bootloader> DfuSession<'_, D> {
    fn status(&mut self) -> Result<DfuStatus, UpdateError> {
        let bytes = self.device.read(GETSTATUS, 0, 6)?;
        let [status, low, middle, high, state, ..] = bytes[..] else {
            return Err(UpdateError::Gone("its status is too short".to_owned()));
        };
        let pause_ms = u32::from_le_bytes([low, middle, high, 0]);
        Ok(DfuStatus {
            status,
            pause: Duration::from_millis(pause_ms.into()),
            state,
        })
    }

    /// Brings it to where it takes any request, from wherever an earlier tool left it.
    fn make_idle(&mut self) -> Result<(), UpdateError> {
        if self.status()?.state == STATE_ERROR {
            self.device.write(CLRSTATUS, 0, &[])?;
        }
        self.device.write(ABORT, 0, &[])?;
        match self.status()?.state {
            STATE_IDLE => Ok(()),
            state => Err(UpdateError::Stuck { state }),
        }
    }

    /// A download, and the wait for its end.
    fn download(&mut self, block: u16, data: &[u8], address: u32) -> Result<(), UpdateError> {
        self.device.write(DNLOAD, block, data)?;
        for _ in 0..POLLS {
            let DfuStatus {
                status,
                pause,
                state,
            } = self.status()?;
            match state {
                STATE_DOWNLOAD_IDLE => return Ok(()),
                STATE_ERROR => return Err(UpdateError::Status { status, address }),
                STATE_BUSY => self.device.pause(pause),
                state => return Err(UpdateError::Stuck { state }),
            }
        }
        Err(UpdateError::Stuck { state: STATE_BUSY })
    }

    fn command(&mut self, command: u8, address: u32) -> Result<(), UpdateError> {
        let [a, b, c, d] = address.to_le_bytes();
        self.download(COMMAND, &[command, a, b, c, d], address)
    }

    fn write(&mut self, address: u32, block: &[u8]) -> Result<(), UpdateError> {
        self.command(SET_ADDRESS, address)?;
        self.download(DATA, block, address)
    }

    fn verify(&mut self, address: u32, block: &[u8]) -> Result<(), UpdateError> {
        self.command(SET_ADDRESS, address)?;
        self.make_idle()?;
        let there = self.device.read(UPLOAD, DATA, block.len())?;
        self.make_idle()?;
        match there == block {
            true => Ok(()),
            false => Err(UpdateError::Verify { address }),
        }
    }

    /// Leaves the bootloader for the program.
    fn start(&mut self) -> Result<(), UpdateError> {
        self.command(SET_ADDRESS, Image::START)?;
        self.device.write(DNLOAD, COMMAND, &[])?;
        // It leaves as it answers, or before.
        let _ = self.status();
        Ok(())
    }
}
