//! What went out of the chip's timer and came in by its converters, tick by tick, and a hash of all of it.

use sha2::{Digest, Sha256};

/// A control tick: an update of TIM1, and the conversions that it started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// The cycle of the update.
    pub cycle: u64,
    /// Compare values that were taken over by it.
    pub compares: [u16; 4],
    /// Whether the outputs were enabled then.
    pub are_enabled: bool,
    /// The cycle in which a compare value was written last, which is for one of the next updates.
    pub written: u64,
    /// The cycle in which the sequence of conversions ended; 0 while it has not.
    pub converted: u64,
    /// Codes of the four current senses.
    pub currents: [u16; 4],
    /// Code of the supply.
    pub supply: u16,
}

/// All ticks so far.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    ticks: u64,
    last: Tick,
    hash: Sha256,
}

impl Trace {
    pub(crate) fn drives(&mut self, cycle: u64, compares: [u16; 4], are_enabled: bool) {
        self.ticks += 1;
        self.last = Tick {
            cycle,
            compares,
            are_enabled,
            ..self.last
        };
        self.hash.update(cycle.to_le_bytes());
        compares
            .iter()
            .for_each(|compare| self.hash.update(compare.to_le_bytes()));
        self.hash.update([u8::from(are_enabled)]);
    }

    pub(crate) fn written(&mut self, cycle: u64) {
        self.last.written = cycle;
    }

    pub(crate) fn converted(&mut self, cycle: u64, currents: [u16; 4], supply: u16) {
        (self.last.converted, self.last.currents, self.last.supply) = (cycle, currents, supply);
        self.hash.update(cycle.to_le_bytes());
        currents
            .iter()
            .chain([&supply])
            .for_each(|code| self.hash.update(code.to_le_bytes()));
    }

    /// Updates of TIM1 so far.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The last tick.
    pub fn last(&self) -> Tick {
        self.last
    }

    /// SHA-256 of all of them, with their times.
    pub fn hash(&self) -> String {
        let digest = self.hash.clone().finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
