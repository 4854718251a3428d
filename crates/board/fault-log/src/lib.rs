//! An append-only log in flash: entries that were acknowledged are there after a power cut at any instant, until newer
//! ones take their place.
//!
//! The flash is a ring of slots, one entry each. Entry number n lies in slot n modulo the number of slots, so that it is
//! found without a search, and an entry that a power cut has torn hides no other. The page that is written next is erased
//! when its first entry is written, never earlier: as many entries as all other pages hold are there at any time.
//!
//! [`Repeats`] says which entries are worth their wear.
#![no_std]

mod entry;
mod repeats;

use embedded_storage::nor_flash::NorFlash;

pub use crate::entry::MAX_BYTES;
use crate::entry::{ENTRY_BYTES, ERASED, Header};
pub use crate::repeats::{Repeats, is_worth_writing};

/// Slots that are tried for one entry before the flash counts as worn out: the first may be torn, or worn.
const ATTEMPTS: u32 = 4;

/// Pages that a log needs at least: one is erased while the others keep their entries.
const MIN_PAGES: usize = 2;

/// A log in a flash of which it has all.
#[derive(Debug)]
pub struct Log<F> {
    flash: F,
    /// The number of the next entry.
    next: u32,
}

/// Why an entry was not taken. Those before it are still there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogError {
    /// The payload is longer than [`MAX_BYTES`].
    TooLong,
    /// No slot took it: each read back other bytes than were written, or failed.
    WornOut,
}

impl<F: NorFlash> Log<F> {
    const GEOMETRY: () = assert!(
        F::ERASE_SIZE.is_multiple_of(ENTRY_BYTES)
            && ENTRY_BYTES.is_multiple_of(F::WRITE_SIZE)
            && ENTRY_BYTES.is_multiple_of(F::READ_SIZE),
        "pages are whole entries, and entries whole words"
    );

    /// Entries in a page.
    const IN_PAGE: u32 = (F::ERASE_SIZE / ENTRY_BYTES) as u32;

    /// The log in `flash`; `None` where that is smaller than two pages. Nothing is written.
    pub fn open(flash: F) -> Option<Self> {
        const { Self::GEOMETRY };
        if flash.capacity() < MIN_PAGES * F::ERASE_SIZE {
            return None;
        }
        let mut log = Self { flash, next: 0 };
        let numbers = (0..log.slots()).filter_map(|slot| log.number_in(slot));
        log.next = numbers.max().map_or(0, |newest| newest.wrapping_add(1));
        Some(log)
    }

    /// Appends an entry, and returns its number. Once this returns, the entry is there until the ring has come round.
    ///
    /// # Errors
    /// Where it does not fit, or the flash does not take it.
    pub fn append(&mut self, payload: &[u8]) -> Result<u32, LogError> {
        if payload.len() > MAX_BYTES {
            return Err(LogError::TooLong);
        }
        let before = self.next;
        for _ in 0..ATTEMPTS {
            self.pass_over_what_is_torn();
            let number = self.next;
            if self.write(number, payload).is_some() {
                self.next = number.wrapping_add(1);
                return Ok(number);
            }
            self.next = self.after_failure(number);
        }
        self.next = before;
        Err(LogError::WornOut)
    }

    /// The newest entry whose number is at most `most`, and its number, in `buffer`.
    pub fn newest_up_to<'a>(
        &mut self,
        most: u32,
        buffer: &'a mut [u8; MAX_BYTES],
    ) -> Option<(u32, &'a [u8])> {
        let newest = self.next.checked_sub(1)?.min(most);
        let passed_over = ATTEMPTS * Self::IN_PAGE;
        let oldest = self.next.saturating_sub(self.slots() + passed_over);
        let number = (oldest..=newest)
            .rev()
            .find(|&number| self.number_in(self.slot(number)) == Some(number))?;
        let bytes = self.read(self.slot(number))?;
        let payload = Header::of(&bytes)?.payload(&bytes)?;
        let place = buffer.get_mut(..payload.len())?;
        place.copy_from_slice(payload);
        Some((number, place))
    }

    /// The flash.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Writes an entry and reads it back; `None` where its slot did not take it.
    fn write(&mut self, number: u32, payload: &[u8]) -> Option<()> {
        let start = self.slot(number) * ENTRY_BYTES as u32;
        if self.begins_page(number) {
            let end = start + F::ERASE_SIZE as u32;
            self.flash.erase(start, end).ok()?;
        }
        let entry = entry::to_bytes(number, payload);
        let length = entry::length(payload).next_multiple_of(F::WRITE_SIZE);
        self.flash.write(start, entry.get(..length)?).ok()?;
        (self.read(self.slot(number))? == entry).then_some(())
    }

    /// Power cuts leave slots that are neither entries nor erased, up to the end of their page.
    fn pass_over_what_is_torn(&mut self) {
        while !self.begins_page(self.next) && self.read(self.slot(self.next)) != Some(ERASED) {
            self.next = self.next.wrapping_add(1);
        }
    }

    /// Where to go on: a slot further, or a page further where that is not even erased.
    fn after_failure(&mut self, number: u32) -> u32 {
        let following = number.wrapping_add(1);
        let is_erased = self.read(self.slot(following)) == Some(ERASED);
        if self.begins_page(number) && !is_erased {
            number.wrapping_add(Self::IN_PAGE)
        } else {
            following
        }
    }

    fn begins_page(&self, number: u32) -> bool {
        self.slot(number).is_multiple_of(Self::IN_PAGE)
    }

    /// The number of the entry in a slot, where that is whole.
    fn number_in(&mut self, slot: u32) -> Option<u32> {
        let header = Header::of(&self.read(slot)?)?;
        (self.slot(header.number) == slot).then_some(header.number)
    }

    fn read(&mut self, slot: u32) -> Option<[u8; ENTRY_BYTES]> {
        let mut bytes = [0; ENTRY_BYTES];
        let start = slot * ENTRY_BYTES as u32;
        self.flash.read(start, &mut bytes).ok()?;
        Some(bytes)
    }

    fn slot(&self, number: u32) -> u32 {
        number % self.slots()
    }

    /// How many entries there is room for.
    fn slots(&self) -> u32 {
        let pages = self.flash.capacity() / F::ERASE_SIZE;
        pages as u32 * Self::IN_PAGE
    }
}
