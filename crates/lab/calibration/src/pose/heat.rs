//! The heat of four actuators that share a part of each pole, in f64: what powers make of it under one calibration, and under another.

use control_core::CHANNELS;
use control_core::calibration::{POLES, Parts};

use super::tables::Table;

/// One number of each actuator.
pub(super) type Each = [f64; CHANNELS];

/// How often the shared heating is found anew from the rises that it makes. Each time what is left falls to a twentieth: the shared part of
/// what the loss grows by with a kelvin.
const ITERATIONS: usize = 4;

/// Poles, what of them is shared, how the losses grow, and by how much each actuator is slower than the poles say.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SharedHeat {
    pub(super) weights: [f64; POLES],
    pub(super) times_s: [f64; POLES],
    /// Part of each pole that the heating of all four drives.
    pub(super) shared: [f64; POLES],
    /// Growth of each actuator's loss (1/K).
    pub(super) growths: Each,
    /// By how much each actuator is slower than the poles say (s).
    pub(super) slower_s: Each,
    /// What a watt is worth to each actuator, of what it was before.
    pub(super) gains: Each,
    /// Watts for a kelvin of each actuator's heating before.
    watts_per_kelvin: Each,
}

/// A time step, and what it leaves of the poles.
pub(super) struct PoleDecay {
    duration_s: f64,
    /// What is left of the distance of each pole from its end after it.
    left: [f64; POLES],
}

/// Where the poles are, each as if its weight were one, and the rises (K).
#[derive(Clone, Debug, Default)]
pub(super) struct Warmed {
    rises: Each,
    own: [Each; POLES],
    /// What drives the shared part of each, followed by it.
    shared: [f64; POLES],
}

/// A time step of the four, before anything is known of the heating in it: the rises at its beginning and without any (K), what they gain with
/// a heating of an actuator's own and with the mean, and the heating that slower ones store besides with each kelvin of their way.
struct HeatStep {
    from: Each,
    free: Each,
    gain_own: f64,
    gain_shared: f64,
    stored: Each,
    /// What each actuator's heating is of what drives the shared part; one in all.
    parts: Each,
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
            slower_s: parts
                .actuators
                .each_ref()
                .map(|actuator| f64::from(actuator.slower_by.0)),
            gains: [1.0; CHANNELS],
            watts_per_kelvin: parts
                .actuators
                .each_ref()
                .map(|actuator| 1.0 / f64::from(actuator.thermal_resistance.0)),
        }
    }

    pub(super) fn time_step(&self, duration_s: f64) -> PoleDecay {
        PoleDecay {
            duration_s,
            left: self.times_s.map(|time_s| match time_s > 0.0 {
                true => (-duration_s / time_s).exp(),
                false => 0.0,
            }),
        }
    }

    /// The time constant with which a step of all own poles begins (s).
    pub(super) fn initial_time_s(&self) -> f64 {
        let poles = self.weights.iter().zip(&self.times_s);
        let used = poles.filter(|(weight, _)| **weight > 0.0);
        1.0 / used.map(|(weight, time_s)| weight / time_s).sum::<f64>()
    }

    /// Of all poles together, what is shared.
    pub(super) fn whole_shared(&self) -> f64 {
        let products = self.weights.iter().zip(&self.shared);
        products.map(|(weight, part)| weight * part).sum()
    }

    /// What is shared of rises at rest (K).
    pub(super) fn shared_rise(&self, rises: &Each) -> f64 {
        self.whole_shared() * dot(&self.parts(), rises)
    }

    /// The powers, as the rises that they would hold without growth (K), at which the actuators rest at `rises`.
    pub(super) fn powers_at_rest(&self, rises: &Each) -> Each {
        let rest = self.rest();
        self.powers(&rest, &self.own_heating(&rest, rises).0, rises)
    }

    /// Powers in watts.
    pub(super) fn watts(&self, powers: &Each) -> Each {
        std::array::from_fn(|i| powers[i] * self.watts_per_kelvin[i])
    }

    /// The rises that powers hold (K).
    pub(super) fn rises_at_rest(&self, powers: &Each) -> Each {
        self.rises(&self.rest(), powers)
    }

    /// The powers during a time step at whose end the rises are these.
    pub(super) fn hold(&self, warmed: &mut Warmed, rises: &Each, time: &PoleDecay) -> Each {
        let step = self.heat_step(warmed, time);
        let (heating, shared) = self.own_heating(&step, rises);
        warmed.advance(rises, (&heating, shared), time);
        self.powers(&step, &heating, rises)
    }

    /// The rises at the end of a time step with these powers (K).
    pub(super) fn heat(&self, warmed: &mut Warmed, powers: &Each, time: &PoleDecay) -> Each {
        let step = self.heat_step(warmed, time);
        let rises = self.rises(&step, powers);
        let heating = self.heating(&step, powers, &rises);
        warmed.advance(&rises, (&heating, dot(&step.parts, &heating)), time);
        rises
    }

    fn heat_step(&self, warmed: &Warmed, time: &PoleDecay) -> HeatStep {
        let left = &time.left;
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
            from: warmed.rises,
            free: free.map(|free| free + free_shared),
            gain_own,
            gain_shared,
            stored: self.slower_s.map(|slower_s| slower_s / time.duration_s),
            parts: self.parts(),
        }
    }

    /// A rest: any time step after which nothing changes.
    fn rest(&self) -> HeatStep {
        let shared = self.whole_shared();
        HeatStep {
            from: [0.0; CHANNELS],
            free: [0.0; CHANNELS],
            gain_own: 1.0 - shared,
            gain_shared: shared,
            stored: [0.0; CHANNELS],
            parts: self.parts(),
        }
    }

    /// What each actuator's heating is of what drives the shared part: in proportion to its watts, for a frame is warmed by those, and
    /// not by the rise that they make of an actuator.
    fn parts(&self) -> Each {
        let watts: Each = std::array::from_fn(|i| self.watts_per_kelvin[i] / self.gains[i]);
        let all: f64 = watts.iter().sum();
        watts.map(|watts| watts / all)
    }

    /// The heating of each during a time step at whose end the rises are these, and what drives the shared part meanwhile.
    fn own_heating(&self, step: &HeatStep, rises: &Each) -> (Each, f64) {
        let alone = std::array::from_fn(|i| rises[i] - step.free[i]);
        let shared = dot(&step.parts, &alone) / (step.gain_own + step.gain_shared);
        let heating = alone.map(|rise| (rise - step.gain_shared * shared) / step.gain_own);
        (heating, shared)
    }

    /// What growing losses take at these rises, and slower actuators store on the way to them (K).
    fn taken(&self, step: &HeatStep, rises: &Each) -> Each {
        std::array::from_fn(|i| {
            self.growths[i] * rises[i] * rises[i] + step.stored[i] * (rises[i] - step.from[i])
        })
    }

    /// Powers under this heat, with what they lose and store (K).
    fn powers(&self, step: &HeatStep, heating: &Each, rises: &Each) -> Each {
        let taken = self.taken(step, rises);
        std::array::from_fn(|i| heating[i] + taken[i])
    }

    /// Powers, less that (K).
    fn heating(&self, step: &HeatStep, powers: &Each, rises: &Each) -> Each {
        let taken = self.taken(step, rises);
        std::array::from_fn(|i| self.gains[i] * powers[i] - taken[i])
    }

    fn rises(&self, step: &HeatStep, powers: &Each) -> Each {
        let mut rises = step.from;
        let mut shared_heating = dot(&step.parts, &self.heating(step, powers, &rises));
        for _ in 0..ITERATIONS {
            rises = std::array::from_fn(|i| {
                let shared = step.free[i] + step.gain_shared * shared_heating;
                let heating = self.gains[i] * powers[i] + step.stored[i] * step.from[i];
                let linear = shared + step.gain_own * heating;
                let slowed = 1.0 + step.gain_own * step.stored[i];
                let root = slowed * slowed + 4.0 * step.gain_own * self.growths[i] * linear;
                2.0 * linear / (slowed + root.max(0.0).sqrt())
            });
            shared_heating = dot(&step.parts, &self.heating(step, powers, &rises));
        }
        rises
    }
}

impl Warmed {
    fn advance(&mut self, rises: &Each, (heating, shared): (&Each, f64), time: &PoleDecay) {
        self.rises = *rises;
        for (at, left) in self.shared.iter_mut().zip(&time.left) {
            *at = shared + (*at - shared) * left;
        }
        for (own, left) in self.own.iter_mut().zip(&time.left) {
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

fn dot(a: &Each, b: &Each) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn mean(of: &Each) -> f64 {
    of.iter().sum::<f64>() / CHANNELS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A beam that shares a frame, and actuators of which one is a tenth slower than its beam and one a tenth quicker.
    fn heat() -> SharedHeat {
        SharedHeat {
            weights: [0.6, 0.4, 0.0, 0.0, 0.0],
            times_s: [1e-3, 33e-3, 0.0, 0.0, 0.0],
            shared: [0.0, 0.9, 0.0, 0.0, 0.0],
            growths: [1e-4, 0.0, -5e-5, 0.0],
            slower_s: [0.0, 1e-4, 0.0, -1e-4],
            gains: [1.0; CHANNELS],
            watts_per_kelvin: [1.0, 0.9, 1.0, 1.1],
        }
    }

    /// Rises in steps of 1 ms along a sine of 20 Hz.
    fn along_a_sine(step: usize) -> Each {
        let phase = std::f64::consts::TAU * 20e-3 * step as f64;
        [60.0 - 10.0 * phase.cos(); CHANNELS]
    }

    #[test]
    fn powers_that_hold_rises_make_them() {
        let heat = heat();
        let time = heat.time_step(1e-3);
        let (mut held, mut made) = (Warmed::default(), Warmed::default());
        for step in 0..200 {
            let asked = along_a_sine(step);
            let powers = heat.hold(&mut held, &asked, &time);
            for (rise, asked) in heat.heat(&mut made, &powers, &time).iter().zip(asked) {
                assert!((rise - asked).abs() < 1e-3, "{rise} for {asked}");
            }
        }
    }

    #[test]
    fn a_slower_actuator_takes_power_for_its_speed() {
        let heat = heat();
        let even = SharedHeat {
            slower_s: [0.0; CHANNELS],
            ..heat.clone()
        };
        let time = heat.time_step(1e-3);
        let (mut slower, mut alike) = (Warmed::default(), Warmed::default());
        for step in 0..200 {
            let asked = along_a_sine(step);
            let speed_k_s = match step {
                0 => asked[0] / 1e-3,
                _ => (asked[0] - along_a_sine(step - 1)[0]) / 1e-3,
            };
            let powers = heat.hold(&mut slower, &asked, &time);
            let others = even.hold(&mut alike, &asked, &time);
            for i in 0..CHANNELS {
                let more = powers[i] - others[i];
                assert!((more - heat.slower_s[i] * speed_k_s).abs() < 1e-9);
            }
        }
    }
}
