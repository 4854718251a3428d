//! The calibrations that outlive a reset, the mirror's and the current sense's: loaded at the start, stored
//! when one of them is put to use.
//!
//! Both lie in one record, so that a power cut leaves the old or the new of both, whole: the mirror's if one was ever
//! stored, and behind it the sense's if that was ever calibrated.

use calibration_store::{Loaded, Store};
use control_core::calibration::{BYTES, record_bytes};
use control_core::{Calibration, SenseCalibration};
use mirror_protocol::{Kept, Sense, SenseInfo};
use protection::Fault;

use crate::factory;
use crate::flash::Part;

/// Flash for one record: whole pages on every board.
const SLOT_BYTES: usize = 4096;

/// Bytes of the longest record.
pub const RECORD_BYTES: usize = BYTES + SenseCalibration::BYTES;

/// Room for a record; an uploaded calibration lies at its start.
pub type Record = [u8; RECORD_BYTES];

/// Keeps calibrations in a board's flash, if that can be used.
pub struct Keeper {
    store: Option<Store<Part, SLOT_BYTES>>,
    kept: Kept,
    sense: SenseCalibration,
    sense_kept: Kept,
}

impl Keeper {
    /// A keeper in `flash`; `None` where the board has none that can be used.
    pub fn new(flash: Option<Part>) -> Self {
        Self {
            store: flash.and_then(Store::new),
            kept: Kept::Factory,
            sense: SenseCalibration::DESIGNED,
            sense_kept: Kept::Factory,
        }
    }

    /// The calibration to start with: the newest stored one that is whole, or the factory's where there is none or it is
    /// bad; likewise [`Self::sense`]. `buffer` is overwritten.
    pub fn load(&mut self, buffer: &mut Record) -> Calibration {
        let loaded = match &mut self.store {
            Some(store) => store.load(buffer),
            None => Ok(Loaded::Empty),
        };
        let (record, whole) = match loaded {
            Ok(Loaded::Stored(bytes)) => (bytes, Kept::Yes),
            Ok(Loaded::Outdated(bytes)) => (bytes, Kept::Outdated),
            Ok(Loaded::Empty) => return factory::calibration(),
            Ok(Loaded::Damaged) | Err(_) => {
                self.kept = Kept::FactoryAsStoredIsBad;
                return factory::calibration();
            }
        };
        let (calibration, sense) = record.split_at(calibration_bytes(record));
        if !sense.is_empty() {
            let stored = SenseCalibration::from_bytes(sense);
            self.sense_kept = kept(stored.is_some(), whole);
            self.sense = stored.unwrap_or(SenseCalibration::DESIGNED);
        }
        if calibration.is_empty() {
            return factory::calibration();
        }
        let stored = Calibration::from_bytes(calibration).ok();
        self.kept = kept(stored.is_some(), whole);
        stored.unwrap_or_else(factory::calibration)
    }

    /// Stores the calibration that lies in its form as bytes at the start of `record`. All channels should be
    /// off: on some boards this takes milliseconds.
    pub fn keep(&mut self, record: &mut Record) {
        self.kept = self.store(record, record_bytes(record));
    }

    /// Puts `sense` to use and stores it beside the calibration that is stored. `buffer` is overwritten. All channels
    /// should be off.
    pub fn keep_sense(&mut self, sense: SenseCalibration, buffer: &mut Record) {
        self.sense = sense;
        // Whatever becomes of it, it is no longer the factory's.
        self.sense_kept = Kept::No;
        let loaded = match &mut self.store {
            Some(store) => store.load(buffer),
            None => return,
        };
        let stored = match loaded {
            Ok(Loaded::Stored(record)) => calibration_bytes(record),
            // It would become the newest, and which one that is to be the user has not said.
            Ok(Loaded::Outdated(_)) => return,
            Ok(Loaded::Empty | Loaded::Damaged) | Err(_) => 0,
        };
        self.sense_kept = self.store(buffer, stored);
    }

    /// Stores the first `calibration_bytes` of `record`, and the sense's calibration behind them.
    fn store(&mut self, record: &mut Record, calibration_bytes: usize) -> Kept {
        let mut end = calibration_bytes;
        if self.sense_kept != Kept::Factory
            && let Some(place) = record
                .get_mut(end..)
                .and_then(|rest| rest.first_chunk_mut::<{ SenseCalibration::BYTES }>())
        {
            *place = self.sense.to_bytes();
            end += place.len();
        }
        let stored = match (&mut self.store, record.get(..end)) {
            (Some(store), Some(record)) => store.store(record).is_ok(),
            _ => false,
        };
        if stored { Kept::Yes } else { Kept::No }
    }

    /// What a board must not overlook: something was stored, and is lost.
    pub fn fault(&self) -> Option<Fault> {
        let either = |state| self.kept == state || self.sense_kept == state;
        if either(Kept::FactoryAsStoredIsBad) {
            Some(Fault::CalibrationBad)
        } else if either(Kept::Outdated) {
            Some(Fault::CalibrationOutdated)
        } else {
            None
        }
    }

    /// Whether the calibration in use is kept.
    pub fn kept(&self) -> Kept {
        self.kept
    }

    /// What the current sense is off by, as far as it is known.
    pub fn sense(&self) -> &SenseCalibration {
        &self.sense
    }

    /// The same for the host, and whether it is kept.
    pub fn sense_info(&self) -> SenseInfo {
        SenseInfo {
            sense: Sense {
                zero_a: self.sense.zero().map(|zero| zero.0),
                gain: self.sense.gain(),
            },
            kept: self.sense_kept,
        }
    }
}

/// Whether a calibration is kept that came out of a record, `whole` where it could be read.
fn kept(is_good: bool, whole: Kept) -> Kept {
    if is_good {
        whole
    } else {
        Kept::FactoryAsStoredIsBad
    }
}

/// Bytes of the mirror's calibration in a record, whole or not.
fn calibration_bytes(record: &[u8]) -> usize {
    if record.len() == SenseCalibration::BYTES {
        0
    } else {
        record.len().min(record_bytes(record))
    }
}
