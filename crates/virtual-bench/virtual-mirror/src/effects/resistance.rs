//! What changes between voltage and heat: leads, contacts, age.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::catalogue::{Effect, Effects};
use crate::per_actuator::PerActuator;

/// Resistance in series with each heater (ohm): bond wires, pads and leads on the chip, 5 to 9 ohm each.
pub(crate) fn leads(effects: &Effects, seed: u64) -> PerActuator {
    let Some(strength) = effects.active(Effect::SeriesResistance) else {
        return PerActuator::ZERO;
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x1ead);
    PerActuator(std::array::from_fn(|_| {
        strength * rng.random_range(5.0..9.0)
    }))
}

/// First and second correction of the linear temperature coefficient, in `1 + a t (1 + t (p + q t))`: what the
/// parallel-resistor law `x / (1 + s x)` of a saturating resistivity is to second order. Platinum's own is -1.5e-4/K:
/// `B/A` of IEC 60751, -5.775e-7 / 3.9083e-3.
pub(crate) fn saturation(effects: &Effects) -> [f64; 2] {
    let per_kelvin = 1.5e-4 * effects.strength(Effect::QuadraticTcr);
    [-per_kelvin, per_kelvin * per_kelvin]
}

/// Slow growth of a heater's resistance with time at temperature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aging {
    per_second: f64,
}

impl Aging {
    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects.active(Effect::HeaterAging).map(|strength| Self {
            per_second: 1e-4 * strength,
        })
    }

    /// Resistance, relative to new, after `h` more seconds at `mean` temperature (K above ambient): an activated
    /// process, 20 K an e-fold about 100 K, that slows as it proceeds.
    pub(crate) fn advanced(&self, aged: PerActuator, mean: PerActuator, h: f64) -> PerActuator {
        let rate =
            mean.map(|kelvin| self.per_second * ((kelvin - 100.0) / 20.0).clamp(-20.0, 5.0).exp());
        let grown = rate.map(|rate| rate * h);
        let slowed = aged.map(|aged| 1.0 / (1.0 + 50.0 * (aged - 1.0)));
        aged + (grown * slowed).map(|growth| growth.min(0.01))
    }
}

/// One bond wire whose contact comes and goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LooseContact {
    actuator: usize,
    ohm: f64,
}

impl LooseContact {
    pub(crate) fn new(effects: &Effects, seed: u64) -> Option<Self> {
        let actuator = ChaCha8Rng::seed_from_u64(seed ^ 0x100e).random_range(0..4);
        effects.active(Effect::LooseContact).map(|strength| Self {
            actuator,
            ohm: 5.0 * strength,
        })
    }

    /// Resistance that it adds at a time (ohm): bad for spells of seconds, in a pattern that does not repeat soon.
    pub(crate) fn ohm(&self, time: f64) -> PerActuator {
        let bad = (time * 0.37).sin() + (time * 0.83).sin() + (time * 0.151).sin() > 1.2;
        let mut ohm = PerActuator::ZERO;
        ohm.0[self.actuator] = if bad { self.ohm } else { 0.0 };
        ohm
    }
}
