//! When the plate will be where it is asked to be.
//!
//! A move takes the time of its path, or as long as an actuator needs that cools, or becomes warm, as fast as it may. At a heating that
//! stays the fast poles' sum rises or falls all the way, so the tick at which it passes the target is found by halving intervals,
//! with the poles' powers of two. From there it catches up as the last part of a move does.

use crate::calibration::{FAST_POLES, Heat};
use crate::design::TICK;
use crate::lag::QuickLag;
use crate::units::{Kelvin, Second};

/// Powers 1, 2, 4, ... of the poles: 2^14 ticks are 1.6 s, and no move takes longer.
const POWERS: usize = 14;
/// So many ticks after its path is over a move is.
pub(crate) const LONGEST: u16 = 1 << POWERS;
/// An actuator that is not there by then never will be: its bounds hold it.
pub(crate) const NEVER: f32 = f32::INFINITY;

/// The core's arithmetic goes no nearer (K): 2 nm.
const NEAREST: Kelvin = Kelvin(1e-3);

/// The fast poles in their powers of two.
#[derive(Clone, Debug)]
pub(crate) struct Decay {
    powers: [[f32; FAST_POLES]; POWERS],
    /// Weights of an actuator's own part of them, and of what all four share.
    own: [f32; FAST_POLES],
    shared: [f32; FAST_POLES],
    /// Time constant of catching up, in ticks.
    catch_up: f32,
    /// Ticks by which a beam comes after its heater.
    beam_lag: f32,
}

/// The way that an actuator has before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// Where it is.
    pub(crate) from: Kelvin,
    /// Where it is to be.
    pub(crate) to: Kelvin,
    /// How near is near enough.
    pub(crate) near: Kelvin,
    /// The heating that takes it there fastest.
    pub(crate) heating: Kelvin,
    /// What drives meanwhile what all four share: the mean of theirs.
    pub(crate) shared_heating: Kelvin,
}

impl Decay {
    /// The poles of `heat`, and an actuator that catches up with this time constant.
    pub(crate) fn new(heat: &Heat, catch_up: Second) -> Self {
        let mut power = heat.fast.each_ref().map(|lag| QuickLag::new(lag).pole());
        let powers = core::array::from_fn(|_| {
            let this = power;
            power = power.map(|pole| pole * pole);
            this
        });
        Self {
            powers,
            own: core::array::from_fn(|pole| (1.0 - heat.shared[pole]) * heat.fast[pole].weight),
            shared: core::array::from_fn(|pole| heat.shared[pole] * heat.fast[pole].weight),
            catch_up: catch_up.0 / TICK.0,
            beam_lag: heat.beam_lag.0 / TICK.0,
        }
    }

    /// Ticks until an actuator is near enough to where it is to be, to within three.
    /// `fast` are the free responses of the fast poles one tick ahead, `slow` what the slow ones bring.
    pub(crate) fn ticks(&self, (fast, slow): ([f32; FAST_POLES], f32), way: &Way) -> f32 {
        let apart = way.from.0 - way.to.0;
        let near = if way.near.0 > NEAREST.0 {
            way.near.0
        } else {
            NEAREST.0
        };
        // Not so for NaN.
        let is_far = apart.abs() > near;
        if !is_far {
            return 0.0;
        }
        let (own, shared) = (way.heating.0, way.shared_heating.0);
        let ends: [f32; FAST_POLES] =
            core::array::from_fn(|pole| self.own[pole] * own + self.shared[pole] * shared);
        let mut left: [f32; FAST_POLES] = core::array::from_fn(|pole| fast[pole] - ends[pole]);
        let end = slow + ends.iter().sum::<f32>();
        let has_passed = |sum: f32| (sum > way.to.0) != (apart > 0.0);
        let mut ticks = 0;
        for (bit, powers) in self.powers.iter().enumerate().rev() {
            let later: [f32; FAST_POLES] = core::array::from_fn(|pole| left[pole] * powers[pole]);
            if !has_passed(end + later.iter().sum::<f32>()) {
                left = later;
                ticks += 1 << bit;
            }
        }
        if ticks + 1 == 1 << POWERS {
            return NEVER;
        }
        let [first, ..] = &self.powers;
        let speed: f32 = left
            .iter()
            .zip(first)
            .map(|(left, pole)| left * (1.0 - pole))
            .sum();
        // It slows down where it is as far away as the time constant takes it.
        let behind = (speed.abs() * self.catch_up).min(apart.abs());
        let catching_up = if behind > near {
            self.catch_up * libm::logf(behind / near)
        } else {
            0.0
        };
        ticks as f32 + catching_up + self.beam_lag
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CHANNELS;
    use crate::calibration::tests::parts;
    use crate::heat::{HeatInverse, HeatState, SharedHeat};
    use crate::lag::TURNS;
    use proptest::prelude::*;

    proptest! {
        /// The tick at which free cooling, or a heating that stays, passes a temperature, against the lags themselves.
        #[test]
        fn the_tick_of_passing_is_found(start in 20.0_f32..100.0, share in 0.05_f32..0.9, up: bool) {
            let mut fast = parts().heat.fast;
            fast[2].weight = 0.2;
            let heat = Heat { fast, ..Heat::INSTANT };
            let inverse = HeatInverse::new(&heat, [0.25; CHANNELS]);
            let mut state = HeatState::default();
            let mut rise = Kelvin(0.0);
            for tick in 0..20_000 {
                rise = inverse.advance(&mut state, Kelvin(start));
                if tick % TURNS == 3 {
                    inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
                }
            }
            let heating = Kelvin(if up { 2.0 * start } else { 0.0 });
            let to = Kelvin(if up { start * (1.0 + share) } else { start * (1.0 - share) });
            let way = Way { from: rise, to, near: Kelvin(1e-3), heating, shared_heating: heating };
            let foreseen = Decay::new(&heat, Second(0.0)).ticks(state.parts(&SharedHeat::default()), &way);
            let mut passed = 0;
            while (rise.0 > to.0) != up && passed < 20_000 {
                rise = inverse.advance(&mut state, heating);
                if passed % TURNS == 3 {
                    inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
                }
                passed += 1;
            }
            // The last tick before it passes is told, of states that are a free response one tick ahead: two ticks early where it cools,
            // fewer by what one tick's heating brings. The powers' rounding, 2^11 times 6e-8, is less than a tick of a pole of 0.2 s.
            let early = passed as f32 - foreseen;
            prop_assert!((-1.0..=3.0).contains(&early), "{foreseen} and {passed}");
        }

        #[test]
        fn any_bit_pattern_is_answered(bits in proptest::array::uniform4(any::<u32>())) {
            let [from, to, near, heating] = bits.map(|bits| Kelvin(f32::from_bits(bits)));
            let way = Way { from, to, near, heating, shared_heating: heating };
            let ticks = Decay::new(&parts().heat, Second(2e-3)).ticks(Default::default(), &way);
            prop_assert!(ticks >= 0.0 || !(from.0.is_finite() && heating.0.is_finite()));
        }
    }

    #[test]
    fn what_no_heating_reaches_is_never_there() {
        let decay = Decay::new(&parts().heat, Second(2e-3));
        let way = Way {
            from: Kelvin(0.0),
            to: Kelvin(50.0),
            near: Kelvin(0.1),
            heating: Kelvin(30.0),
            shared_heating: Kelvin(30.0),
        };
        assert_eq!(decay.ticks(Default::default(), &way), NEVER);
    }

    #[test]
    fn what_others_keep_warm_is_never_there() {
        let mut heat = parts().heat;
        heat.fast[1].weight = 0.4;
        heat.shared[1] = 0.5;
        let decay = Decay::new(&heat, Second(2e-3));
        // All four at 60 K; one is to cool to 10 K, of which the others, where they stay, bring it 0.4 * 0.5 * 0.75 * 60.
        let warm = heat.fast.each_ref().map(|lag| 60.0 * lag.weight);
        let ticks = |shared_heating| {
            let way = Way {
                from: Kelvin(60.0),
                to: Kelvin(8.9),
                near: Kelvin(0.05),
                heating: Kelvin(0.0),
                shared_heating: Kelvin(shared_heating),
            };
            decay.ticks((warm, 0.0), &way)
        };
        assert_eq!(ticks(45.0), NEVER);
        assert!(ticks(0.0) < NEVER);
    }
}
