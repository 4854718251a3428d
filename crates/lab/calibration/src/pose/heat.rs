//! The heat of four actuators that share a part of each pole, in f64: what powers make of it under one calibration, and under another.

use control_core::CHANNELS;
use control_core::calibration::{POLES, Parts};

use super::tables::Table;

/// One number of each actuator.
pub(super) type Each = [f64; CHANNELS];

/// How often the mean heating is found anew from the rises that it makes. Each time what is left falls to a twentieth: the shared part of
/// what the loss grows by with a kelvin.
const ITERATIONS: usize = 4;

/// Poles, what of them is shared, and how the losses grow.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SharedHeat {
    pub(super) weights: [f64; POLES],
    pub(super) times_s: [f64; POLES],
    /// Part of each pole that the mean heating of all four drives.
    pub(super) shared: [f64; POLES],
    /// Growth of each actuator's loss (1/K).
    pub(super) growths: Each,
    /// What a watt is worth to each actuator, of what it was before.
    pub(super) gains: Each,
}

/// What is left of the distance of each pole from its end after a time step.
pub(super) type Left = [f64; POLES];

/// Where the poles are, each as if its weight were one (K).
#[derive(Clone, Debug, Default)]
pub(super) struct Warmed {
    own: [Each; POLES],
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
        self.whole_shared() * mean(rises)
    }

    /// The powers, as the rises that they would hold without growth (K), at which the actuators rest at `rises`.
    pub(super) fn powers_at_rest(&self, rises: &Each) -> Each {
        let shared = self.shared_rise(rises);
        let own = 1.0 - self.whole_shared();
        std::array::from_fn(|i| (rises[i] - shared) / own + self.growths[i] * rises[i] * rises[i])
    }

    /// The rises that powers hold (K).
    pub(super) fn rises_at_rest(&self, powers: &Each) -> Each {
        let shared = self.whole_shared();
        let rest = HeatStep {
            free: [0.0; CHANNELS],
            gain_own: 1.0 - shared,
            gain_shared: shared,
        };
        self.rises(&rest, powers)
    }

    /// The powers during a time step at whose end the rises are these.
    pub(super) fn hold(&self, warmed: &mut Warmed, rises: &Each, left: &Left) -> Each {
        let step = self.heat_step(warmed, left);
        let free_mean = mean(&step.free);
        let heating_mean = (mean(rises) - free_mean) / (step.gain_own + step.gain_shared);
        let heating: Each = std::array::from_fn(|i| {
            (rises[i] - step.free[i] - step.gain_shared * heating_mean) / step.gain_own
        });
        warmed.advance(&heating, left);
        std::array::from_fn(|i| heating[i] + self.growths[i] * rises[i] * rises[i])
    }

    /// The rises at the end of a time step with these powers (K).
    pub(super) fn heat(&self, warmed: &mut Warmed, powers: &Each, left: &Left) -> Each {
        let step = self.heat_step(warmed, left);
        let rises = self.rises(&step, powers);
        warmed.advance(&self.heating(powers, &rises), left);
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
            free_shared += shared * left[k] * mean(own);
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

    /// Powers, less what growing losses take at these rises (K).
    fn heating(&self, powers: &Each, rises: &Each) -> Each {
        std::array::from_fn(|i| self.gains[i] * powers[i] - self.growths[i] * rises[i] * rises[i])
    }

    fn rises(&self, step: &HeatStep, powers: &Each) -> Each {
        let mut rises = [0.0; CHANNELS];
        let mut heating_mean = mean(&self.heating(powers, &rises));
        for _ in 0..ITERATIONS {
            rises = std::array::from_fn(|i| {
                let shared = step.free[i] + step.gain_shared * heating_mean;
                let linear = shared + step.gain_own * self.gains[i] * powers[i];
                let root = 1.0 + 4.0 * step.gain_own * self.growths[i] * linear;
                2.0 * linear / (1.0 + root.max(0.0).sqrt())
            });
            heating_mean = mean(&self.heating(powers, &rises));
        }
        rises
    }
}

impl Warmed {
    fn advance(&mut self, heating: &Each, left: &Left) {
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
