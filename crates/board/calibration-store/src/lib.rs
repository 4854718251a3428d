//! Keeps bytes in flash, so that after a power cut at any instant either the old or the new ones are
//! there, whole.
//!
//! The flash is a ring of slots. An update goes to the slot after the newest whole record: erase,
//! payload, then the header with length, sequence number and CRC, then all of it is read back, and
//! only then it counts. Loading writes nothing, so there is no recovery that a second power cut could
//! disturb. What is read is the whole record with the highest sequence number.
//!
//! What was read back is sealed, and the record before loses its seal. So a record that was whole and has rotted
//! since, sealed but not whole, differs from one that was cut off: an older one is not taken for the newest in silence.
//!
//! Why more than two slots: the word that was being written when the power went may read as whole at
//! one start and as broken at the next. With two slots the next update would erase the only sound
//! record; with more of them it stays.
#![no_std]

mod error;
mod record;

use embedded_storage::nor_flash::NorFlash;

pub use crate::error::StoreError;
use crate::record::{Header, Slot};

/// Slots that a store needs at least, see above.
pub const MIN_SLOTS: u32 = 3;

/// Records in a flash of which the store has all: at least [`MIN_SLOTS`] of `SLOT_BYTES`, which are
/// whole erase pages.
#[derive(Debug)]
pub struct Store<F, const SLOT_BYTES: usize> {
    flash: F,
}

/// What a store holds.
#[derive(Debug, PartialEq, Eq)]
pub enum Loaded<'a> {
    /// The newest whole record.
    Stored(&'a [u8]),
    /// Nothing was ever stored.
    Empty,
    /// The newest record that is whole; a newer one, stored and acknowledged, has rotted since.
    Outdated(&'a [u8]),
    /// Something was stored, and nothing of it is whole.
    Damaged,
}

impl<F: NorFlash, const SLOT_BYTES: usize> Store<F, SLOT_BYTES> {
    /// Longest payload, bytes.
    pub const MAX_BYTES: usize = SLOT_BYTES - Header::BYTES;

    const GEOMETRY: () = assert!(
        SLOT_BYTES.is_multiple_of(F::ERASE_SIZE)
            && Header::BYTES.is_multiple_of(F::WRITE_SIZE)
            && Header::BYTES.is_multiple_of(F::READ_SIZE),
        "slots are whole pages, and headers whole words"
    );

    /// The store in `flash`; `None` where that is too small for [`MIN_SLOTS`].
    pub fn new(flash: F) -> Option<Self> {
        const { Self::GEOMETRY };
        let store = Self { flash };
        (store.slots() >= MIN_SLOTS).then_some(store)
    }

    /// The newest whole record, in `buffer`. Nothing is written.
    ///
    /// # Errors
    /// [`StoreError::Unreadable`]; [`StoreError::TooLong`] where `buffer` is shorter than the record.
    pub fn load<'a>(&mut self, buffer: &'a mut [u8]) -> Result<Loaded<'a>, StoreError> {
        let Survey {
            newest,
            has_rotted,
            is_blank,
        } = self.survey()?;
        let Some((slot, header)) = newest else {
            return Ok(if is_blank {
                Loaded::Empty
            } else {
                Loaded::Damaged
            });
        };
        let payload = buffer
            .get_mut(..header.length())
            .ok_or(StoreError::TooLong)?;
        self.slot(slot).read_payload(payload)?;
        Ok(if has_rotted && !self.slot(slot).is_sealed()? {
            Loaded::Outdated(payload)
        } else {
            Loaded::Stored(payload)
        })
    }

    /// Stores `payload`. Once this returns `Ok`, every later [`Self::load`] finds it, or what was
    /// stored after it.
    ///
    /// # Errors
    /// Where it does not fit, or the flash does not take it.
    pub fn store(&mut self, payload: &[u8]) -> Result<(), StoreError> {
        if payload.len() > Self::MAX_BYTES {
            return Err(StoreError::TooLong);
        }
        let newest = self.survey()?.newest;
        let (in_use, sequence) = match newest {
            Some((slot, header)) => (slot, header.sequence().wrapping_add(1)),
            None => (self.slots() - 1, 0),
        };
        let header = Header::of(sequence, payload);
        // A worn slot is passed over; the one in use is never touched.
        for step in 1..self.slots() {
            let slot = (in_use + step) % self.slots();
            if self.slot(slot).write(&header, payload).is_ok() {
                self.unseal_all_but(slot);
                return Ok(());
            }
        }
        Err(StoreError::WornOut)
    }

    /// Takes the seals off the records that one in `newest` follows. Where that fails the newest is whole all the same.
    fn unseal_all_but(&mut self, newest: u32) {
        for slot in (0..self.slots()).filter(|&slot| slot != newest) {
            let _ = self.slot(slot).unseal();
        }
    }

    /// The flash.
    pub fn into_flash(self) -> F {
        self.flash
    }

    fn survey(&mut self) -> Result<Survey, StoreError> {
        let mut survey = Survey {
            newest: None,
            has_rotted: false,
            is_blank: true,
        };
        for index in 0..self.slots() {
            let mut slot = self.slot(index);
            if let Some(header) = slot.whole_record()? {
                let newest = survey.newest.map(|(_, newest)| newest.sequence());
                if newest.is_none_or(|newest| header.sequence() > newest) {
                    survey.newest = Some((index, header));
                }
            } else {
                survey.has_rotted |= slot.is_sealed()?;
            }
            survey.is_blank = survey.is_blank && slot.is_blank()?;
        }
        Ok(survey)
    }

    fn slots(&self) -> u32 {
        (self.flash.capacity() / SLOT_BYTES) as u32
    }

    fn slot(&mut self, index: u32) -> Slot<'_, F, SLOT_BYTES> {
        Slot::new(&mut self.flash, index)
    }
}

/// What lies in the slots.
struct Survey {
    newest: Option<(u32, Header)>,
    /// A record that was whole once is not any more.
    has_rotted: bool,
    is_blank: bool,
}
