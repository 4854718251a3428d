//! The beams at their drive attract the grounded substrate below them.

use super::catalogue::{Effect, Effects};
use crate::per_actuator::PerActuator;

/// The pull of a parallel plate on springs, to first order in what it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Electrostatic {
    /// Displacement that one volt squared makes where the gap is open (m/V2).
    compliance: f64,
}

impl Electrostatic {
    /// Height of the open gap (m), as for the heat that crosses it.
    const OPEN: f64 = 300e-6;

    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects
            .active(Effect::ElectrostaticPull)
            .map(|strength| Self {
                compliance: 0.3e-6 * strength,
            })
    }

    /// How far the plate is pulled down (m) with its piston at `piston` (m): the force goes as (V / gap)^2.
    pub(crate) fn pull(&self, volts: PerActuator, piston: f64) -> f64 {
        let closed = (piston / Self::OPEN).clamp(-0.5, 0.7);
        0.25 * (volts * volts).sum() * self.compliance / (1.0 - closed).powi(2)
    }
}
