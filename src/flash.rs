//! The parts of a board's flash that outlive a reset.

mod sizes;

use core::cell::RefCell;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, ReadNorFlash};

pub use self::sizes::{CALIBRATION_BYTES, FLASH_BYTES, LOG_BYTES};
use crate::board::BoardFlash;

/// A part of the flash. Both parts are used in turns, by tasks of the same executor.
pub struct Part {
    flash: &'static RefCell<BoardFlash>,
    start: usize,
    bytes: usize,
}

/// The parts for the fault log and for the calibrations.
pub fn divide(flash: &'static RefCell<BoardFlash>) -> (Part, Part) {
    let log = Part {
        flash,
        start: 0,
        bytes: LOG_BYTES,
    };
    let calibrations = Part {
        flash,
        start: LOG_BYTES,
        bytes: CALIBRATION_BYTES,
    };
    (log, calibrations)
}

/// What a part of the flash does not do.
#[derive(Debug)]
pub enum PartError<E> {
    /// It ends before that.
    Beyond,
    /// As the flash says.
    Flash(E),
}

impl<E: NorFlashError> NorFlashError for PartError<E> {
    fn kind(&self) -> embedded_storage::nor_flash::NorFlashErrorKind {
        match self {
            Self::Beyond => embedded_storage::nor_flash::NorFlashErrorKind::OutOfBounds,
            Self::Flash(error) => error.kind(),
        }
    }
}

impl Part {
    /// Has `act` use the flash, at the place there that is `bytes` long and `offset` from the start of this part.
    fn act<T, E>(
        &self,
        offset: u32,
        bytes: usize,
        act: impl FnOnce(&mut BoardFlash, u32) -> Result<T, E>,
    ) -> Result<T, PartError<E>> {
        let end = (offset as usize).checked_add(bytes);
        if end.is_none_or(|end| end > self.bytes) {
            return Err(PartError::Beyond);
        }
        let start = offset + self.start as u32;
        act(&mut self.flash.borrow_mut(), start).map_err(PartError::Flash)
    }
}

impl ErrorType for Part {
    type Error = PartError<<BoardFlash as ErrorType>::Error>;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = BoardFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.act(offset, bytes.len(), |flash, at| flash.read(at, bytes))
    }

    fn capacity(&self) -> usize {
        self.bytes
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = BoardFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = BoardFlash::ERASE_SIZE;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.act(offset, bytes.len(), |flash, at| flash.write(at, bytes))
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        let bytes = to.saturating_sub(from);
        self.act(from, bytes as usize, |flash, at| {
            flash.erase(at, at + bytes)
        })
    }
}
