//! What a bench does to the whole mirror: another room, an oven, a stage.

use super::VirtualMirror;
use crate::effects::heat::LossLaw;
use crate::per_actuator::PerActuator;

/// Time in which the room jumps to another temperature, for what remembers motion (s).
const JUMP_S: f64 = 1e-6;

impl VirtualMirror {
    /// Brings the mirror to a room, or an oven, that is `warmer_k` warmer than the one that it was made in. All of it is that
    /// much warmer at once; what the drives and a drifting room add counts from there. Not finite counts as 0.
    pub fn set_ambient(&mut self, warmer_k: f64) {
        let warmer_k = if warmer_k.is_finite() { warmer_k } else { 0.0 };
        if warmer_k == self.network.warmer {
            return;
        }
        self.network.ambient += warmer_k - self.network.warmer;
        self.network.warmer = warmer_k;
        self.network.loss = LossLaw::new(&self.effects, self.ambient_c + warmer_k, warmer_k);
        let before = self.still.value;
        self.shape.displace(
            &self.theta,
            self.network.ambient,
            &self.plastic,
            &mut self.still,
        );
        self.memory = self.memory.advanced(before, self.still.value, JUMP_S);
        self.rate_drive = PerActuator::splat(f64::NAN);
    }

    /// Moves the stage that the whole mirror is on: the sensor sees its target `um` further in the direction of the substrate.
    /// Not finite counts as 0.
    pub fn set_stage(&mut self, um: f64) {
        self.stage = if um.is_finite() { um * 1e-6 } else { 0.0 };
    }
}
