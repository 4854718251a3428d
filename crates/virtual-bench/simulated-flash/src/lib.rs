//! NOR flash with the rules of the STM32G474 (RM0440, section 5): pages of 2 KB are erased whole,
//! double words of 8 bytes are written once, or once more with zeros, and the power can go in the middle of either.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Bytes that are erased together.
pub const PAGE_BYTES: usize = 2048;
/// Bytes that are written together.
pub const WORD_BYTES: usize = 8;
/// Erase cycles that the data sheet promises of a page (DS12288, table 51).
pub const PAGE_ENDURANCE: u32 = 10_000;

const ERASED: u8 = 0xff;

/// A flash in the middle of its life.
#[derive(Clone, Debug)]
pub struct SimulatedFlash {
    bytes: Vec<u8>,
    /// Words that the power left half written, or half erased.
    is_unsound: Vec<bool>,
    erase_counts: Vec<u32>,
    operations: u64,
    power: Power,
    /// Operations after which nothing is written or erased any more.
    endures: u64,
    words: HalfWords,
    rng: ChaCha8Rng,
}

/// How a word reads that was being written or erased when the power went: at random in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HalfWords {
    /// The same at every read.
    Settle,
    /// Differently after every start, until its page is erased.
    Flicker,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    /// On, for ever.
    On,
    /// On, until this many operations are done; the next is cut in its middle.
    For(u64),
    Off,
}

/// What the flash does not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// The power is off.
    PowerOff,
    /// A word is written that is not erased, and not with zeros.
    Overwrite,
    /// It is worn out.
    WornOut,
    /// Not whole words or pages, or beyond the end.
    Bounds(NorFlashErrorKind),
}

impl SimulatedFlash {
    /// An erased flash; the seed draws what half-written words read as.
    pub fn new(pages: usize, words: HalfWords, seed: u64) -> Self {
        Self::holding(vec![ERASED; pages * PAGE_BYTES], words, seed)
    }

    /// A flash that holds these bytes, of whole pages: what is behind the last of them is left out.
    pub fn holding(mut bytes: Vec<u8>, words: HalfWords, seed: u64) -> Self {
        let pages = bytes.len() / PAGE_BYTES;
        bytes.truncate(pages * PAGE_BYTES);
        Self {
            is_unsound: vec![false; bytes.len() / WORD_BYTES],
            bytes,
            erase_counts: vec![0; pages],
            operations: 0,
            power: Power::On,
            endures: u64::MAX,
            words,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// The same flash, with another draw of what half-written words read as.
    #[must_use]
    pub fn reseeded(&self, seed: u64) -> Self {
        let mut other = self.clone();
        other.rng = ChaCha8Rng::seed_from_u64(seed);
        other
    }

    /// Cuts the power in the middle of the operation after the next `operations`.
    pub fn cut_power_after(&mut self, operations: u64) {
        self.power = Power::For(operations);
    }

    /// Turns the power on again, for good.
    pub fn power_up(&mut self) {
        self.power = Power::On;
        if self.words == HalfWords::Flicker {
            for word in 0..self.is_unsound.len() {
                if self.is_unsound[word] {
                    let at = word * WORD_BYTES;
                    self.rng.fill(&mut self.bytes[at..at + WORD_BYTES]);
                }
            }
        }
    }

    /// Wears it out after so many more operations: from then on none of them does anything, and each says so.
    pub fn wear_out_after(&mut self, operations: u64) {
        self.endures = self.operations + operations;
    }

    /// Lets one bit fall over.
    ///
    /// # Panics
    /// Beyond the end.
    pub fn flip(&mut self, bit: usize) {
        self.bytes[bit / 8] ^= 1 << (bit % 8);
    }

    /// What it holds.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Writes of a word and erasures of a page so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// How often each page was erased.
    pub fn erase_counts(&self) -> &[u32] {
        &self.erase_counts
    }

    /// Begins an operation; whether it comes to its end.
    fn begin(&mut self) -> Result<bool, FlashError> {
        if self.operations >= self.endures {
            return Err(FlashError::WornOut);
        }
        let completes = match self.power {
            Power::Off => return Err(FlashError::PowerOff),
            Power::On => true,
            Power::For(0) => {
                self.power = Power::Off;
                false
            }
            Power::For(left) => {
                self.power = Power::For(left - 1);
                true
            }
        };
        self.operations += 1;
        Ok(completes)
    }

    fn write_word(&mut self, at: usize, word: &[u8]) -> Result<(), FlashError> {
        let target = at..at + WORD_BYTES;
        let is_erased = self.bytes[target.clone()]
            .iter()
            .all(|byte| *byte == ERASED);
        // Zeros may be written over anything (RM0440, section 3.3.8, PROGERR).
        if !is_erased && word.iter().any(|byte| *byte != 0) {
            return Err(FlashError::Overwrite);
        }
        if self.begin()? {
            self.bytes[target].copy_from_slice(word);
            self.is_unsound[at / WORD_BYTES] = false;
            return Ok(());
        }
        // Some bits made it. One time in four all did, which is the trap.
        let mask: u64 = match self.rng.random_ratio(1, 4) {
            true => u64::MAX,
            false => self.rng.random(),
        };
        let mask = mask.to_le_bytes();
        for ((byte, new), made) in self.bytes[target].iter_mut().zip(word).zip(mask) {
            *byte &= *new | !made;
        }
        self.is_unsound[at / WORD_BYTES] = true;
        Err(FlashError::PowerOff)
    }

    fn erase_page(&mut self, page: usize) -> Result<(), FlashError> {
        let start = page * PAGE_BYTES;
        let target = start..start + PAGE_BYTES;
        let words = start / WORD_BYTES..(start + PAGE_BYTES) / WORD_BYTES;
        let completes = self.begin()?;
        self.erase_counts[page] += 1;
        if completes {
            self.bytes[target].fill(ERASED);
            self.is_unsound[words].fill(false);
            return Ok(());
        }
        // From hardly begun to all but done, bit by bit.
        let done = self.rng.random_range(0.0..=1.0);
        for byte in &mut self.bytes[target] {
            for bit in 0..8 {
                if self.rng.random_bool(done) {
                    *byte |= 1 << bit;
                }
            }
        }
        self.is_unsound[words].fill(true);
        Err(FlashError::PowerOff)
    }
}

/// A flash that a test keeps hold of while a board uses it.
#[derive(Clone, Debug)]
pub struct SharedFlash(Arc<Mutex<SimulatedFlash>>);

impl SharedFlash {
    /// Shares `flash`.
    pub fn new(flash: SimulatedFlash) -> Self {
        Self(Arc::new(Mutex::new(flash)))
    }

    /// The flash, for this moment.
    pub fn lock(&self) -> MutexGuard<'_, SimulatedFlash> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ErrorType for SharedFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SharedFlash {
    const READ_SIZE: usize = SimulatedFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.lock().read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.lock().capacity()
    }
}

impl NorFlash for SharedFlash {
    const WRITE_SIZE: usize = SimulatedFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = SimulatedFlash::ERASE_SIZE;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.lock().write(offset, bytes)
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.lock().erase(from, to)
    }
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds(kind) => *kind,
            Self::PowerOff | Self::Overwrite | Self::WornOut => NorFlashErrorKind::Other,
        }
    }
}

impl ErrorType for SimulatedFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SimulatedFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Bounds)?;
        if self.power == Power::Off {
            return Err(FlashError::PowerOff);
        }
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for SimulatedFlash {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = PAGE_BYTES;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Bounds)?;
        for (word, at) in bytes
            .chunks_exact(WORD_BYTES)
            .zip((offset as usize..).step_by(WORD_BYTES))
        {
            self.write_word(at, word)?;
        }
        Ok(())
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Bounds)?;
        for page in from as usize / PAGE_BYTES..to as usize / PAGE_BYTES {
            self.erase_page(page)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flash() -> SimulatedFlash {
        SimulatedFlash::new(2, HalfWords::Settle, 1)
    }

    #[test]
    fn a_word_is_written_once_and_a_page_erased_whole() {
        let mut flash = flash();
        flash.write(8, &[1; 16]).expect("erased");
        assert_eq!(flash.write(16, &[1; 8]), Err(FlashError::Overwrite));
        flash.write(8, &[0; 8]).expect("zeros go over anything");
        assert!(matches!(
            flash.write(4, &[1; 8]),
            Err(FlashError::Bounds(_))
        ));
        assert!(matches!(flash.erase(0, 8), Err(FlashError::Bounds(_))));
        flash.erase(0, 2048).expect("a page");
        flash.write(16, &[2; 8]).expect("erased again");
        assert_eq!(flash.erase_counts(), [1, 0]);
        assert_eq!(flash.operations(), 5);
    }

    #[test]
    fn a_worn_one_keeps_what_it_has_and_takes_nothing_more() {
        let mut flash = flash();
        flash.wear_out_after(1);
        flash.write(0, &[1; 8]).expect("its last");
        assert_eq!(flash.write(8, &[2; 8]), Err(FlashError::WornOut));
        assert_eq!(flash.erase(0, 2048), Err(FlashError::WornOut));
        let mut bytes = [0; 16];
        flash.read(0, &mut bytes).expect("it is read");
        assert_eq!(bytes, [[1; 8], [ERASED; 8]].concat()[..]);
    }

    #[test]
    fn a_cut_leaves_what_was_before_whole_and_the_word_itself_at_random() {
        let mut flash = flash();
        flash.cut_power_after(1);
        assert_eq!(flash.write(0, &[0; 24]), Err(FlashError::PowerOff));
        assert_eq!(flash.read(0, &mut [0; 8]), Err(FlashError::PowerOff));
        flash.power_up();
        let mut bytes = [0; 24];
        flash.read(0, &mut bytes).expect("powered");
        assert_eq!(bytes[..8], [0; 8]);
        assert_eq!(bytes[16..], [ERASED; 8]);
    }
}
