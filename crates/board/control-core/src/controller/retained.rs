//! What outlives a reset of the board.
//!
//! The mirror stays as warm as it is and remembers what it did, so a controller that begins anew goes on with the states of the one
//! before, which have cooled meanwhile: a board without a program drives nothing.

use super::{Controller, Setpoint};
use crate::CHANNELS;
use crate::calibration::{LAGS, PLAYS, POLES};
use crate::design::UNDRIVEN_TICKS;
use crate::heat::{HeatState, SHARED_POLES, SharedHeat};
use crate::units::{Ampere, Volt};

/// The states of an actuator, and of what all four share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Retained {
    /// What the play operators of its memory hold, and the lags of its creep (um).
    plays: [f32; PLAYS],
    creep: [f32; LAGS],
    /// Its own part of the thermal poles, and what all four share of them (K).
    heat: [f32; POLES],
    shared: [f32; SHARED_POLES],
}

impl Retained {
    /// How many words it takes.
    pub const WORDS: usize = PLAYS + LAGS + POLES + SHARED_POLES;

    /// No number of it is greater than this (um, K): no mirror goes so far, or is so warm.
    const MOST: f32 = 1e4;

    /// As words of memory.
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let memory = self.plays.iter().chain(&self.creep);
        let values = memory.chain(&self.heat).chain(&self.shared);
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
            heat: core::array::from_fn(|_| next()),
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
            heat: state.heat.held(),
            shared: self.shared.held(),
        }
    }

    /// Goes on with the states of a controller that was reset, after the ticks of a start, in which nothing is driven. To be called before
    /// the first step.
    pub fn recall(&mut self, retained: &[Retained; CHANNELS]) {
        self.shared = SharedHeat::of(retained[0].shared);
        self.budget.recall();
        let actuators = self.calibration.actuators();
        let states = self.actuators.iter_mut().zip(actuators).zip(retained);
        for ((state, actuator), kept) in states {
            let heat = HeatState::of(kept.heat, &self.shared);
            let position = actuator.shape.position(heat.free_response());
            let memory = self.memory.of(kept.plays, kept.creep, position);
            state.begin(heat, memory);
        }
        for _ in 0..UNDRIVEN_TICKS {
            self.step(
                Setpoint::Off,
                [Volt(0.0); CHANNELS],
                [Ampere(0.0); CHANNELS],
            );
        }
    }
}
