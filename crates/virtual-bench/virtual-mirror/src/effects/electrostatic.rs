//! The beams at their drive attract the grounded substrate below them.

use super::catalogue::{Effect, Effects};
use crate::per_actuator::PerActuator;

/// The pull on beams on springs, to first order in what it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Electrostatic {
    /// Displacement that one volt squared makes where the gap is open (m/V2).
    compliance: f64,
}

impl Electrostatic {
    /// Height of the open gap (m), as for the heat that crosses it.
    const OPEN: f64 = 300e-6;
    /// The part of the gap beyond which it grows no more (1): beams that would touch.
    const CLOSED: f64 = 0.9;
    /// The power of the gap that the force falls with: 2 between plates, 1 and less around a wire.
    const FRINGED: f64 = 1.6;

    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects
            .active(Effect::ElectrostaticPull)
            .map(|strength| Self {
                compliance: 0.3e-6 * strength,
            })
    }

    /// How far the plate is pulled down (m) with its piston at `piston` (m): between narrow beams and a wide substrate the
    /// force falls with the gap more slowly than between plates, since the field fringes.
    pub(crate) fn pull(&self, volts: PerActuator, piston: f64) -> f64 {
        let closed = (piston / Self::OPEN).clamp(-0.5, Self::CLOSED);
        0.25 * (volts * volts).sum() * self.compliance / (1.0 - closed).powf(Self::FRINGED)
    }
}
