//! Flash: a file of the emulator's, with the pages and words of the STM32G474.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use plant_link::{FLASH, FLASH_ERASED, FLASH_IS_WORN};
use semihosting::fs::File;
use semihosting::io::{Read, Seek, SeekFrom, Write};

use crate::flash::FLASH_BYTES;

const PAGE_BYTES: usize = 2048;
const WORD_BYTES: usize = 8;
const _: () = assert!(plant_link::FLASH_BYTES == FLASH_BYTES);

/// What outlives a reset.
pub struct BoardFlash(File);

impl BoardFlash {
    /// `None` where the emulator was started without such a file.
    pub fn open() -> Option<Self> {
        let file = File::options().read(true).write(true).open(FLASH).ok()?;
        Some(Self(file))
    }

    fn write_at(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        if File::open(FLASH_IS_WORN).is_ok() {
            return Err(NorFlashErrorKind::Other);
        }
        self.seek(offset)?;
        self.0
            .write_all(bytes)
            .map_err(|_| NorFlashErrorKind::Other)
    }

    fn seek(&mut self, offset: u32) -> Result<(), NorFlashErrorKind> {
        let sought = self.0.seek(SeekFrom::Start(offset.into()));
        sought.map(drop).map_err(|_| NorFlashErrorKind::Other)
    }
}

impl ErrorType for BoardFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        self.seek(offset)?;
        self.0
            .read_exact(bytes)
            .map_err(|_| NorFlashErrorKind::Other)
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = PAGE_BYTES;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        self.write_at(offset, bytes)
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for page in (from..to).step_by(PAGE_BYTES) {
            self.write_at(page, &[FLASH_ERASED; PAGE_BYTES])?;
        }
        Ok(())
    }
}
