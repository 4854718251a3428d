//! What an actuator's stages are off by that is heated otherwise than a level plate asks for, while nobody has measured what the four share of
//! their heat.
//!
//! A calibration of the piston alone takes all of an actuator's slow heat for its own. On a level plate that is as good as any part of it; where
//! one is heated more than the others, their plate and frame are less warm than its stages say, and the others' warmer.

use super::period::PERIOD;
use crate::calibration::{FASTEST_SHARED, Heat};
use crate::lag::rate;
use crate::units::Kelvin;

/// What may be shared of the heat of a calibration that does not know it.
#[derive(Clone, Debug)]
pub(super) struct Unshared {
    /// Weights of the fast poles that may be, and of the slow ones.
    fast: f32,
    slow: f32,
    /// Of a difference, the heaviest slow pole takes up so much from one pass to the next.
    rate: f32,
}

/// How much an actuator is heated beyond what a level plate asks for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Uneven {
    /// Of late, as the slow poles are by it (K).
    before: f32,
    /// Of what a reading may be off by for it (K^2).
    pub(super) variance: f32,
}

impl Unshared {
    /// `None` where the calibration knows what is shared, and where there is nothing that could be.
    pub(super) fn of(heat: &Heat) -> Option<Self> {
        if heat.shared.iter().any(|part| *part > 0.0) {
            return None;
        }
        // The first is the beam's.
        let [_, fast @ ..] = &heat.fast;
        let shareable = fast.iter().filter(|lag| lag.time.0 >= FASTEST_SHARED.0);
        let [first, second] = &heat.slow;
        let heaviest = if first.weight < second.weight {
            second
        } else {
            first
        };
        let unshared = Self {
            fast: shareable.map(|lag| lag.weight).sum(),
            slow: first.weight + second.weight,
            rate: rate(heaviest.time, PERIOD),
        };
        (unshared.fast + unshared.slow > 0.0).then_some(unshared)
    }
}

impl Uneven {
    /// A period passes in which it is this much warmer than on a level plate at the mean height of the four.
    pub(super) fn pass(&mut self, unshared: &Unshared, warmer: Kelvin) {
        self.before += unshared.rate * (warmer.0 - self.before);
        let off = unshared.fast * warmer.0.abs() + unshared.slow * self.before.abs();
        self.variance = off * off;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Lag;
    use crate::units::Second;

    fn heat(shared: f32) -> Heat {
        let lag = |weight, seconds| Lag {
            weight,
            time: Second(seconds),
        };
        Heat {
            fast: [lag(0.5, 1e-3), lag(0.1, 2e-3), lag(0.3, 30e-3)],
            slow: [lag(0.1, 4.0), Lag::NONE],
            shared: [0.0, 0.0, 0.0, shared, 0.0],
            ..Heat::INSTANT
        }
    }

    #[test]
    fn what_slow_poles_hold_of_an_uneven_drive_passes_with_them() {
        assert!(Unshared::of(&heat(0.5)).is_none());
        let unshared = Unshared::of(&heat(0.0)).expect("nobody knows it");
        let mut uneven = Uneven::default();
        let seconds = |uneven: &mut Uneven, kelvin, seconds: f32| {
            let passes = (seconds / (PERIOD as f32 * 1e-4)) as usize;
            (0..passes).for_each(|_| uneven.pass(&unshared, Kelvin(kelvin)));
            fpu::sqrt(uneven.variance)
        };
        // What a 30 ms pole and one of 4 s have of 20 K, and after one of its times the latter.
        let driven = seconds(&mut uneven, -20.0, 40.0);
        assert!((driven - 8.0).abs() < 0.01, "{driven}");
        let level = seconds(&mut uneven, 0.0, 4.0);
        assert!((level - 2.0 * f32::exp(-1.0)).abs() < 0.01, "{level}");
    }
}
