//! Another calibration in the place of the one in use, stage after stage.
//!
//! The mirror stays as warm as it is and remembers what it does, so each stage goes on from where it was with other numbers. All of it takes
//! longer than a tick has, so one stage at a time is exchanged while nothing is driven.

use super::{Controller, NOWHERE, Next, highest};
use crate::CHANNELS;
use crate::actuator::{Rails, catch_up_time};
use crate::calibration::{Calibration, Parts};
use crate::heat::HeatInverse;
use crate::heat::inherited::PolesBefore;
use crate::limits::Limits;
use crate::memory::{MemoryInverse, Successors};
use crate::path::PathPlanner;
use crate::plate::PlateInverse;
use crate::settling::Decay;
use crate::shaper::Shaper;
use crate::surroundings::Surroundings;
use crate::units::Kelvin;

/// What is exchanged before the memory's actuators, and with them.
const BEFORE_ACTUATORS: usize = 7;
const WITH_ACTUATORS: usize = BEFORE_ACTUATORS + CHANNELS;

impl<'a> Controller<'a> {
    /// Inverts `calibration` from now on, and returns the one before.
    pub fn exchange(&mut self, calibration: &'a mut Calibration) -> &'a mut Calibration {
        self.begin_exchange(calibration);
        loop {
            if let Some(before) = self.exchange_on() {
                return before;
            }
        }
    }

    /// Begins to exchange the calibration for another one. Nothing is to be driven until [`Self::exchange_on`] is through with it.
    pub fn begin_exchange(&mut self, calibration: &'a mut Calibration) {
        self.next = Some(Next {
            calibration,
            exchanged: 0,
            heat: None,
            memory: None,
        });
    }

    /// Whether a calibration is being exchanged.
    pub fn is_exchanging(&self) -> bool {
        self.next.is_some()
    }

    /// Exchanges a stage, or what one actuator remembers, which a tick has room for in the place of a step
    /// (`docs/figures/control-tick.md`); returns the calibration before once all of them are.
    // Out of the way of the ticks that exchange nothing.
    #[cold]
    #[inline(never)]
    pub fn exchange_on(&mut self) -> Option<&'a mut Calibration> {
        let mut next = self.next.take()?;
        let parts = next.calibration.parts();
        match next.exchanged {
            0 => next.heat = Some(self.prepare_heat(parts)),
            1 => {
                if let Some((heat, from)) = next.heat.take() {
                    self.exchange_heat(parts, heat, &from);
                }
            }
            2 => self.exchange_bounds(parts),
            3 => self.exchange_surroundings(parts),
            4 => self.exchange_shapes(parts),
            5 => self.shaper = Shaper::new(&parts.path.resonance),
            6 => next.memory = Some(self.exchange_memory(parts)),
            BEFORE_ACTUATORS..WITH_ACTUATORS => {
                if let Some((before, successors)) = &next.memory {
                    self.inherit_memory(next.exchanged - BEFORE_ACTUATORS, before, successors);
                }
            }
            _ => {
                self.exchange_plate(parts);
                return Some(core::mem::replace(&mut self.calibration, next.calibration));
            }
        }
        next.exchanged += 1;
        self.next = Some(next);
        None
    }

    /// What takes the place of the heat's inverse, and what its poles go on with.
    fn prepare_heat(&self, parts: &Parts) -> (HeatInverse, PolesBefore) {
        let heat = HeatInverse::new(&parts.heat, parts.shared_gains());
        let from = heat.poles_before(&self.heat);
        (heat, from)
    }

    fn exchange_heat(&mut self, parts: &Parts, heat: HeatInverse, from: &PolesBefore) {
        let before = core::mem::replace(&mut self.heat, heat);
        let worth: [_; CHANNELS] =
            core::array::from_fn(|i| self.actuators[i].worth_under(&parts.actuators[i]));
        self.shared = self
            .heat
            .inherit_shared((from, &before, &self.shared), |heating| {
                let each = worth.each_ref().map(|worth| worth(heating).0);
                Kelvin(each.iter().sum::<f32>() / CHANNELS as f32)
            });
        for (actuator, worth) in self.actuators.iter_mut().zip(&worth) {
            let followed = (from, &before, &actuator.heat);
            actuator.heat = self.heat.inherit(&self.shared, followed, worth);
        }
    }

    fn exchange_bounds(&mut self, parts: &Parts) {
        self.rails = Rails::new(parts);
        self.decay = Decay::new(&parts.heat, catch_up_time(parts));
    }

    /// The memory before, which each actuator has still to inherit; until then none is advanced.
    fn exchange_memory(&mut self, parts: &Parts) -> (MemoryInverse, Successors) {
        let before = core::mem::replace(
            &mut self.memory,
            MemoryInverse::new(&parts.memory, parts.bounds.drive),
        );
        let successors = self.memory.successors(&before);
        self.budget.exchange(parts, &self.memory, &successors);
        (before, successors)
    }

    fn inherit_memory(&mut self, actuator: usize, before: &MemoryInverse, from: &Successors) {
        let state = &mut self.actuators[actuator % CHANNELS].memory;
        let was = before.before_creep(state);
        *state = self.memory.inherit(from, (before, state));
        let is = self.memory.before_creep(state);
        self.budget
            .inherit(actuator, (&self.memory, is), (before, was));
    }

    fn exchange_surroundings(&mut self, parts: &Parts) {
        let is_used = self.surroundings.is_wanted();
        self.surroundings = Surroundings::new(parts);
        self.surroundings.compensate(is_used);
        self.sense_limits = Limits::NONE;
    }

    fn exchange_shapes(&mut self, parts: &Parts) {
        for (actuator, calibration) in self.actuators.iter_mut().zip(&parts.actuators) {
            actuator.recalibrate(calibration);
        }
        (self.highest, self.highest_limits) = highest(parts);
    }

    fn exchange_plate(&mut self, parts: &Parts) {
        self.plate = PlateInverse::new(&parts.plate, parts.actuators[0].shape.top());
        let place = self.path.place();
        self.path = PathPlanner::new(&parts.path);
        *self.path.follow() = place;
        self.target = NOWHERE;
    }
}
