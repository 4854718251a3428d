//! A flash whose bytes lie in a file, which outlives the board.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use firmware_on_host::FLASH_PAGES;
use simulated_flash::{HalfWords, PAGE_BYTES, SharedFlash, SimulatedFlash};

/// What a flash holds, and its file.
pub(crate) const FLASH_BYTES: usize = FLASH_PAGES * PAGE_BYTES;

/// The board's flash, and the file that it is kept in, if it is.
pub(crate) struct KeptFlash {
    pub(crate) flash: SharedFlash,
    file: Option<PathBuf>,
    /// Operations of the flash when it was kept last.
    kept: u64,
}

impl KeptFlash {
    /// The flash that `file` holds; an erased one where there is none yet, or nothing is kept.
    ///
    /// # Errors
    /// Where the file cannot be read, or is no flash of this board.
    pub(crate) fn open(file: Option<&Path>) -> io::Result<Self> {
        let flash = match file {
            Some(file) if file.exists() => {
                let bytes = fs::read(file)?;
                if bytes.len() != FLASH_BYTES {
                    let what = format!("{} is no flash of this board", file.display());
                    return Err(io::Error::new(io::ErrorKind::InvalidData, what));
                }
                SimulatedFlash::holding(bytes, HalfWords::Settle, 0)
            }
            _ => SimulatedFlash::new(FLASH_PAGES, HalfWords::Settle, 0),
        };
        let mut kept = Self {
            flash: SharedFlash::new(flash),
            file: file.map(Path::to_owned),
            // So that a new file is there at once, and whether it can be written is known.
            kept: u64::MAX,
        };
        kept.keep()?;
        Ok(kept)
    }

    /// Writes the file where the flash has changed; what was there stays until the new one is whole.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn keep(&mut self) -> io::Result<()> {
        let Some(file) = &self.file else {
            return Ok(());
        };
        let flash = self.flash.lock();
        if flash.operations() == self.kept {
            return Ok(());
        }
        self.kept = flash.operations();
        let mut beside = file.clone().into_os_string();
        beside.push(".new");
        fs::write(&beside, flash.bytes())?;
        fs::rename(beside, file)
    }
}

#[cfg(test)]
mod tests {
    use embedded_storage::nor_flash::NorFlash;

    use super::*;

    #[test]
    fn what_is_written_is_there_for_the_next_board() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("board.flash");
        let mut first = KeptFlash::open(Some(&file)).expect("a new file");
        first.flash.write(8, &[7; 8]).expect("erased");
        first.keep().expect("it is written");
        let second = KeptFlash::open(Some(&file)).expect("its file");
        let flash = second.flash.lock();
        assert_eq!(flash.bytes()[..24], [[0xff; 8], [7; 8], [0xff; 8]].concat());
        fs::write(&file, "short").expect("ours");
        let refused = KeptFlash::open(Some(&file)).err().expect("no flash");
        assert!(refused.to_string().contains("is no flash"), "{refused}");
    }
}
