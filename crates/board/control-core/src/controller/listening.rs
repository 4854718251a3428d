//! What the currents tell: of each actuator in its turn, and of the surroundings of all four.

use super::{Controller, UNNOTICED, turns_since_own};
use crate::CHANNELS;
use crate::actuator::Actuator;
use crate::limits::{Limit, Limits};
use crate::surroundings::Evidence;
use crate::units::{Ampere, Kelvin, Volt};

/// The turn in which the surroundings are updated: one in which no actuator is read or followed.
const UPDATE_TURN: usize = 13;

impl Controller<'_> {
    /// What the current of the actuator whose turn it is tells of it, and what follows.
    pub(super) fn listen(&mut self, applied: &[Volt; CHANNELS], currents: &[Ampere; CHANNELS]) {
        let actuator = self.turn % CHANNELS;
        let (applied, current) = (applied[actuator], currents[actuator]);
        self.step.sense[actuator] = self.actuators[actuator].sense(applied, current);
        match turns_since_own(self.turn) {
            0 => self.read(actuator, current),
            // The one that was read last, which no update has come between.
            1 => {
                let read = (actuator + CHANNELS - 1) % CHANNELS;
                self.surroundings.follow(read, self.asked[read]);
            }
            _ if self.turn == UPDATE_TURN => self.update(),
            // Where nothing is foreseen either.
            3 if self.surroundings.is_compared(current) => self.compare(actuator, current),
            _ => {}
        }
    }

    /// What its resistance tells of the surroundings.
    fn read(&mut self, actuator: usize, current: Ampere) {
        if let Some(evidence) = self.evidence(actuator, current) {
            self.surroundings.read(actuator, &evidence);
        }
    }

    /// Whether it is the heater of the calibration's mirror.
    fn compare(&mut self, actuator: usize, current: Ampere) {
        if let Some(evidence) = self.evidence(actuator, current) {
            self.surroundings.compare(actuator, &evidence);
            self.budget.doubt(self.surroundings.are_heaters_doubted());
        }
    }

    /// What its resistance tells, and what its stages do.
    fn evidence(&self, actuator: usize, current: Ampere) -> Option<Evidence> {
        let sense = self.step.sense[actuator].as_ref()?;
        let rises = self.actuators.iter().map(|actuator| actuator.rise().0);
        let mean_rise = Kelvin(rises.sum::<f32>() / CHANNELS as f32);
        let heat = (&self.heat, &self.shared);
        self.actuators[actuator].evidence(sense, current, mean_rise, heat)
    }

    /// What follows from all four.
    fn update(&mut self) {
        let asked = self.asked.iter().map(|rise| rise.0).sum::<f32>();
        self.surroundings.update(Kelvin(asked / CHANNELS as f32));
        self.rails.probe(self.surroundings.is_probing());
        let mut lowest = (0..CHANNELS).map(|actuator| self.surroundings.lowest(actuator));
        let are_bent = lowest.any(|lowest| lowest.0 > UNNOTICED.0);
        self.lowest_limits = Limits::NONE;
        self.lowest_limits.insert(match are_bent {
            true => Limit::RoomWarm,
            false => Limit::Cooling,
        });
        let mut actuators = self.actuators.iter();
        self.sense_limits = Limits::NONE;
        if actuators.any(Actuator::is_resistance_unknown) {
            self.sense_limits.insert(Limit::ResistanceUnknown);
        }
        if self.surroundings.has_drifted() {
            self.sense_limits.insert(Limit::CalibrationDrifted);
        }
    }
}

// In the turn of the update none is read or followed.
const _: () = assert!(turns_since_own(UPDATE_TURN) > 1);
