//! The heat of four actuators that share a part of each pole, in f64: what powers make of it under one calibration, and under another.

use control_core::CHANNELS;
use control_core::calibration::{POLES, Parts};

use super::tables::Table;

/// One number of each actuator.
pub(super) type Each = [f64; CHANNELS];

/// How often the shared heating is found anew from the rises that it makes. Each time what is left falls to a twentieth: the shared part of
/// what the loss grows by with a kelvin.
const ITERATIONS: usize = 4;

/// Poles, what of them is shared, and how the losses grow.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SharedHeat {
    pub(super) weights: [f64; POLES],
    pub(super) times_s: [f64; POLES],
    /// Part of each pole that the heating of all four drives.
    pub(super) shared: [f64; POLES],
    /// Growth of each actuator's loss (1/K).
    pub(super) growths: Each,
    /// What a watt is worth to each actuator, of what it was before.
    pub(super) gains: Each,
    /// Watts for a kelvin of each actuator's heating before.
    watts_per_kelvin: Each,
}

/// What is left of the distance of each pole from its end after a time step.
pub(super) type Left = [f64; POLES];

/// Where the poles are, each as if its weight were one (K).
#[derive(Clone, Debug, Default)]
pub(super) struct Warmed {
    own: [Each; POLES],
    /// What drives the shared part of each, followed by it.
    shared: [f64; POLES],
}

/// A time step of the four, before anything is known of the heating in it: the rises without any (K), and what they gain with a heating of an
/// actuator's own and with the mean.
struct HeatStep {
    free: Each,
    gain_own: f64,
    gain_shared: f64,
}

impl SharedHeat {
    pub(super) fn of(parts: &Parts) -> Self {
        let poles = parts.heat.poles();
        Self {
            weights: poles.map(|pole| f64::from(pole.weight)),
            times_s: poles.map(|pole| f64::from(pole.time.0)),
            shared: parts.heat.shared.map(f64::from),
            growths: parts
                .actuators
                .each_ref()
                .map(|actuator| f64::from(actuator.loss_growth.0)),
            gains: [1.0; CHANNELS],
            watts_per_kelvin: parts
                .actuators
                .each_ref()
                .map(|actuator| 1.0 / f64::from(actuator.thermal_resistance.0)),
        }
    }

    pub(super) fn left(&self, step_s: f64) -> Left {
        self.times_s.map(|time_s| match time_s > 0.0 {
            true => (-step_s / time_s).exp(),
            false => 0.0,
        })
    }

    /// Of all poles together, what is shared.
    pub(super) fn whole_shared(&self) -> f64 {
        let products = self.weights.iter().zip(&self.shared);
        products.map(|(weight, part)| weight * part).sum()
    }

    /// What is shared of rises at rest (K).
    pub(super) fn shared_rise(&self, rises: &Each) -> f64 {
        self.whole_shared() * self.shared_mean(rises)
    }

    /// The powers, as the rises that they would hold without growth (K), at which the actuators rest at `rises`.
    pub(super) fn powers_at_rest(&self, rises: &Each) -> Each {
        let heating = self.own_heating(&self.rest(), rises).0;
        std::array::from_fn(|i| heating[i] + self.growths[i] * rises[i] * rises[i])
    }

    /// The rises that powers hold (K).
    pub(super) fn rises_at_rest(&self, powers: &Each) -> Each {
        self.rises(&self.rest(), powers)
    }

    /// The powers during a time step at whose end the rises are these.
    pub(super) fn hold(&self, warmed: &mut Warmed, rises: &Each, left: &Left) -> Each {
        let step = self.heat_step(warmed, left);
        let (heating, shared) = self.own_heating(&step, rises);
        warmed.advance(&heating, shared, left);
        std::array::from_fn(|i| heating[i] + self.growths[i] * rises[i] * rises[i])
    }

    /// The rises at the end of a time step with these powers (K).
    pub(super) fn heat(&self, warmed: &mut Warmed, powers: &Each, left: &Left) -> Each {
        let step = self.heat_step(warmed, left);
        let rises = self.rises(&step, powers);
        let heating = self.heating(powers, &rises);
        warmed.advance(&heating, self.shared_mean(&heating), left);
        rises
    }

    fn heat_step(&self, warmed: &Warmed, left: &Left) -> HeatStep {
        let (mut free, mut free_shared) = ([0.0; CHANNELS], 0.0);
        let (mut gain_own, mut gain_shared) = (0.0, 0.0);
        for (k, own) in warmed.own.iter().enumerate() {
            let shared = self.weights[k] * self.shared[k];
            let alone = self.weights[k] - shared;
            gain_own += alone * (1.0 - left[k]);
            gain_shared += shared * (1.0 - left[k]);
            free_shared += shared * left[k] * warmed.shared[k];
            for (free, at) in free.iter_mut().zip(own) {
                *free += alone * left[k] * at;
            }
        }
        HeatStep {
            free: free.map(|free| free + free_shared),
            gain_own,
            gain_shared,
        }
    }

    /// A rest: any time step after which nothing changes.
    fn rest(&self) -> HeatStep {
        let shared = self.whole_shared();
        HeatStep {
            free: [0.0; CHANNELS],
            gain_own: 1.0 - shared,
            gain_shared: shared,
        }
    }

    /// The heating of all four that drives what they share (K): each in proportion to its watts, for a frame is warmed by those, and
    /// not by the rise that they make of an actuator.
    fn shared_mean(&self, heating: &Each) -> f64 {
        let watts = |i: usize| self.watts_per_kelvin[i] / self.gains[i];
        let sum: f64 = (0..CHANNELS).map(|i| watts(i) * heating[i]).sum();
        sum / (0..CHANNELS).map(watts).sum::<f64>()
    }

    /// The heating of each during a time step at whose end the rises are these, and what drives the shared part meanwhile.
    fn own_heating(&self, step: &HeatStep, rises: &Each) -> (Each, f64) {
        let alone = std::array::from_fn(|i| rises[i] - step.free[i]);
        let shared = self.shared_mean(&alone) / (step.gain_own + step.gain_shared);
        let heating = alone.map(|rise| (rise - step.gain_shared * shared) / step.gain_own);
        (heating, shared)
    }

    /// Powers, less what growing losses take at these rises (K).
    fn heating(&self, powers: &Each, rises: &Each) -> Each {
        std::array::from_fn(|i| self.gains[i] * powers[i] - self.growths[i] * rises[i] * rises[i])
    }

    fn rises(&self, step: &HeatStep, powers: &Each) -> Each {
        let mut rises = [0.0; CHANNELS];
        let mut shared_heating = self.shared_mean(&self.heating(powers, &rises));
        for _ in 0..ITERATIONS {
            rises = std::array::from_fn(|i| {
                let shared = step.free[i] + step.gain_shared * shared_heating;
                let linear = shared + step.gain_own * self.gains[i] * powers[i];
                let root = 1.0 + 4.0 * step.gain_own * self.growths[i] * linear;
                2.0 * linear / (1.0 + root.max(0.0).sqrt())
            });
            shared_heating = self.shared_mean(&self.heating(powers, &rises));
        }
        rises
    }
}

impl Warmed {
    fn advance(&mut self, heating: &Each, shared: f64, left: &Left) {
        for (at, left) in self.shared.iter_mut().zip(left) {
            *at = shared + (*at - shared) * left;
        }
        for (own, left) in self.own.iter_mut().zip(left) {
            for (at, to) in own.iter_mut().zip(heating) {
                *at = to + (*at - to) * left;
            }
        }
    }
}

/// A calibration's tables under other heat: on a level plate at rest the same powers hold the same position, at other rises.
pub(super) fn level_rises(
    (before, tables): (&SharedHeat, &[Table; CHANNELS]),
    after: &SharedHeat,
    um: f64,
) -> Each {
    let rises = tables.each_ref().map(|table| table.rise(um));
    after.rises_at_rest(&before.powers_at_rest(&rises))
}

pub(super) fn mean(of: &Each) -> f64 {
    of.iter().sum::<f64>() / CHANNELS as f64
}
