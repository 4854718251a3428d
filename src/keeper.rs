//! The calibration that outlives a reset: loaded at the start, stored when it is put to use.

use calibration_store::{Loaded, Store};
use control_core::Calibration;
use control_core::calibration::BYTES;
use mirror_protocol::Kept;
use protection::Fault;

use crate::board::CalibrationFlash;
use crate::factory;

/// Flash for one calibration: whole pages on every board.
const SLOT_BYTES: usize = 4096;

/// Keeps calibrations in a board's flash, if that can be used.
pub struct Keeper {
    store: Option<Store<CalibrationFlash, SLOT_BYTES>>,
    kept: Kept,
}

impl Keeper {
    /// A keeper in `flash`; `None` where the board has none that can be used.
    pub fn new(flash: Option<CalibrationFlash>) -> Self {
        Self {
            store: flash.and_then(Store::new),
            kept: Kept::Factory,
        }
    }

    /// The calibration to start with: the stored one, or the factory's where there is none or it is
    /// bad. `buffer` is overwritten.
    pub fn load(&mut self, buffer: &mut [u8; BYTES]) -> Calibration {
        let loaded = match &mut self.store {
            Some(store) => store.load(buffer),
            None => Ok(Loaded::Empty),
        };
        let stored = match loaded {
            Ok(Loaded::Stored(bytes)) => Calibration::from_bytes(bytes).ok(),
            Ok(Loaded::Empty) => {
                self.kept = Kept::Factory;
                return factory::calibration();
            }
            Ok(Loaded::Damaged) | Err(_) => None,
        };
        self.kept = match stored {
            Some(_) => Kept::Yes,
            None => Kept::FactoryAsStoredIsBad,
        };
        stored.unwrap_or_else(factory::calibration)
    }

    /// Stores a calibration in its form as bytes. All channels should be off: on some boards this
    /// takes milliseconds.
    pub fn keep(&mut self, bytes: &[u8]) {
        let stored = match &mut self.store {
            Some(store) => store.store(bytes).is_ok(),
            None => false,
        };
        self.kept = if stored { Kept::Yes } else { Kept::No };
    }

    /// What a board must not overlook: a calibration was stored, and is lost.
    pub fn fault(&self) -> Option<Fault> {
        (self.kept == Kept::FactoryAsStoredIsBad).then_some(Fault::CalibrationBad)
    }

    /// Whether the calibration in use is kept.
    pub fn kept(&self) -> Kept {
        self.kept
    }
}
