//! What changes so slowly that it stands still within a step: room, contacts, age, the gap, the air around
//! the beams, yielded films.

use crate::config::MirrorConfig;
use crate::effects::heat::{AmbientDrift, Gap, Stagnant};
use crate::effects::memory::Yield;
use crate::effects::resistance::{Aging, LooseContact};
use crate::per_actuator::PerActuator;
use crate::shape::Shape;
use crate::thermal::{Field, Network};

/// The slow effects that are on.
#[derive(Clone, Debug)]
pub(crate) struct Slow {
    drift: Option<AmbientDrift>,
    contact: Option<LooseContact>,
    aging: Option<Aging>,
    gap: Option<Gap>,
    stagnant: Option<Stagnant>,
    softening: Option<Yield>,
    leads: PerActuator,
}

impl Slow {
    pub(crate) fn new(config: &MirrorConfig, network: &Network) -> Option<Self> {
        let effects = &config.effects;
        let slow = Self {
            drift: AmbientDrift::new(effects),
            contact: LooseContact::new(effects, config.seed),
            aging: Aging::new(effects),
            gap: Gap::new(effects),
            stagnant: Stagnant::new(effects),
            softening: Yield::new(effects),
            leads: network.leads,
        };
        let idle = slow.drift.is_none()
            && slow.contact.is_none()
            && slow.aging.is_none()
            && slow.gap.is_none()
            && slow.stagnant.is_none()
            && slow.softening.is_none();
        (!idle).then_some(slow)
    }

    /// Longest step in which all of them stand still (s).
    pub(crate) fn longest_s(&self) -> f64 {
        if self.stagnant.is_some() { 0.01 } else { 0.5 }
    }

    /// Sets the network to what holds in a step that ends at `time` (s) and has the beams' ends at `end` (m) halfway.
    pub(crate) fn prepare(&self, network: &mut Network, time: f64, end: PerActuator) {
        if let Some(drift) = &self.drift {
            network.ambient = network.ambient_set + drift.kelvin(time);
        }
        if let Some(contact) = &self.contact {
            network.leads = self.leads + contact.ohm(time);
        }
        if let Some(gap) = &self.gap {
            let cells = network.cells.len() as f64;
            for (i, cell) in network.cells.iter_mut().enumerate() {
                let growth = gap.growth(end, (i as f64 + 0.5) / cells);
                cell.to_gap = cell.to_air * (growth - PerActuator::splat(1.0));
            }
        }
    }

    /// What a step of `h` seconds that came to `theta` leaves behind.
    pub(crate) fn leave(&self, network: &mut Network, shape: &mut Shape, theta: &Field, h: f64) {
        if let Some(aging) = &self.aging {
            network.aged = aging.advanced(network.aged, network.heater_mean(theta), h);
        }
        if let Some(stagnant) = &self.stagnant {
            network.stagnant = stagnant.advanced(network.stagnant, network.heater_mean(theta), h);
        }
        if let Some(softening) = &self.softening {
            for (plastic, theta) in shape.plastic.iter_mut().zip(theta.beams()) {
                *plastic = softening.advanced(*plastic, *theta);
            }
        }
    }
}
