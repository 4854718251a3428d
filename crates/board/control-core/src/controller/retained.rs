//! What outlives a reset of the board.
//!
//! The mirror stays as warm as it is and remembers what it did, so a controller that begins anew goes on with the slow states of the one
//! before. Quick ones are gone by then: a board without a program drives nothing.

use super::Controller;
use crate::CHANNELS;
use crate::calibration::{LAGS, PLAYS, SLOW_POLES};
use crate::heat::{HeatState, SharedHeat};

/// The slow states of an actuator, and of what all four share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Retained {
    /// What the play operators of its memory hold, and the lags of its creep (um).
    plays: [f32; PLAYS],
    creep: [f32; LAGS],
    /// Its own part of the slow poles, and what all four share of them (K).
    slow: [f32; SLOW_POLES],
    shared: [f32; SLOW_POLES],
}

impl Retained {
    /// How many words it takes.
    pub const WORDS: usize = PLAYS + LAGS + 2 * SLOW_POLES;

    /// No number of it is greater than this (um, K): no mirror goes so far, or is so warm.
    const MOST: f32 = 1e4;

    /// As words of memory.
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let memory = self.plays.iter().chain(&self.creep);
        let values = memory.chain(&self.slow).chain(&self.shared);
        let mut words = [0; Self::WORDS];
        for (word, value) in words.iter_mut().zip(values) {
            *word = value.to_bits();
        }
        words
    }

    /// From such words; `None` where a number of them is none that a mirror can have.
    pub fn from_words(words: &[u32; Self::WORDS]) -> Option<Self> {
        let mut values = words.map(f32::from_bits).into_iter();
        let is_plausible = values.clone().all(|value| value.abs() <= Self::MOST);
        let mut next = || values.next().unwrap_or_default();
        is_plausible.then(|| Self {
            plays: core::array::from_fn(|_| next()),
            creep: core::array::from_fn(|_| next()),
            slow: core::array::from_fn(|_| next()),
            shared: core::array::from_fn(|_| next()),
        })
    }
}

impl Controller<'_> {
    /// What of an actuator is to outlive a reset.
    pub fn retained(&self, actuator: usize) -> Retained {
        let state = &self.actuators[actuator % CHANNELS];
        let (plays, creep) = state.memory.held();
        Retained {
            plays,
            creep,
            slow: state.heat.slow(),
            shared: self.shared.slow(),
        }
    }

    /// Goes on with the slow states of a controller that was reset: the mirror has cooled as far as its quick poles do. To be called
    /// before the first step.
    pub fn recall(&mut self, retained: &[Retained; CHANNELS]) {
        self.shared = SharedHeat::cooled(retained[0].shared);
        for (actuator, kept) in self.actuators.iter_mut().zip(retained) {
            let heat = HeatState::cooled(kept.slow, &self.shared);
            actuator.begin(heat, self.memory.cooled(kept.plays, kept.creep));
        }
    }
}
