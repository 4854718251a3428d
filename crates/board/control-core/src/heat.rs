//! The stage `heat` inverted: the heating that takes the temperature in one tick to where it must be.
//!
//! The lags' states are those of the mirror itself, advanced with what was really driven. So what a
//! limit cut off is asked for again in the next tick, and nothing winds up (anti-windup by state
//! feedback of the saturated input).
//!
//! A part of a pole may be driven by the mean heating of all four actuators, as that of the frame they stand on. It is slow against a
//! tick, so what the four have in common is brought up to date pole by pole, told ahead by as much as it is late, and taken into each
//! actuator's turn; with that the four are inverted apart, and their coupling needs no inverse of its own.
//!
//! The poles tell the heater's temperature. The beam follows it with a lag of its own, so on its way the heater is asked to be ahead.
//! Time constants may grow with the rise: on its way an actuator then takes besides what a growing heat capacity would store.

use crate::CHANNELS;
use crate::calibration::{FAST_POLES, Heat, Lag, POLES, SLOW_POLES};
use crate::design::TICK;
use crate::lag::{QuickLag, SlowLag, SlowState, TURNS};
use crate::units::Kelvin;

/// The numbers of the inverse.
#[derive(Clone, Debug)]
pub(crate) struct HeatInverse {
    fast: [QuickLag; FAST_POLES],
    slow: [SlowLag; SLOW_POLES],
    shared: [SlowLag; SHARED_POLES],
    /// Input gain of all poles over one tick, and its inverse.
    input_gain: f32,
    per_input_gain: f32,
    /// Weight of the actuator's own part of the fast poles together.
    fast_weight: f32,
    /// Time constant with which a beam follows its heater, in ticks.
    beam_lag: f32,
    /// The heating that is stored for each square kelvin by which the rise's square changes in a tick (1/K): half of what the time constants
    /// grow by with a kelvin, in ticks.
    stored_per_k2: f32,
}

/// Temperatures of the lags of one actuator.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeatState {
    fast: [f32; FAST_POLES],
    slow: [SlowState; SLOW_POLES],
    /// What they bring, and what all four actuators share.
    slow_sum: f32,
    /// Heating since the slow ones' last turn.
    heating: f32,
    /// The free response one tick ahead: the temperature rise without heating.
    free_response: f32,
}

/// What the four actuators share.
#[derive(Clone, Debug, Default)]
pub(crate) struct SharedHeat {
    lags: [SlowState; SHARED_POLES],
    /// Where each will be in the middle of the time for which it is told.
    ahead: [f32; SHARED_POLES],
    /// Sum of them.
    sum: f32,
    /// Mean heating of all four in their last turns.
    heating: f32,
    /// The turns so far, summed.
    gathered: f32,
    /// What the fast ones have still to bring.
    unsettled: f32,
}

/// All poles but the first, one in each turn.
pub(crate) const SHARED_POLES: usize = POLES - 1;
/// The fast ones of them.
const SHARED_FAST: usize = FAST_POLES - 1;

/// Ticks by which what is shared is told ahead: the heating that drives it is some ticks old, and what an actuator takes of it in its turn
/// it keeps for [`TURNS`] ticks. Of whole ticks this one leaves the least error along a sine (test `what_is_shared_is_followed_in_turns`).
const AHEAD: f32 = 6.0;

/// What time constants may have grown by at the least, over what they are without any rise (`TIME_GROWTHS` in `plausible.rs`). A drive may
/// heat beyond the rise for which that was checked, and a time constant that is none left would be divided by.
const LEAST_SLOWING: f32 = -0.9;

impl HeatInverse {
    pub(crate) fn new(heat: &Heat) -> Self {
        let poles = heat.poles();
        let part = |pole: usize, part: f32| Lag {
            weight: part * poles[pole].weight,
            time: poles[pole].time,
        };
        let own = |pole: usize| part(pole, 1.0 - heat.shared[pole]);
        let own_fast: [Lag; FAST_POLES] = core::array::from_fn(own);
        let fast = own_fast.each_ref().map(QuickLag::new);
        let input_gain = fast.iter().map(|lag| lag.input_gain).sum::<f32>();
        Self {
            fast,
            slow: core::array::from_fn(|lag| SlowLag::new(&own(FAST_POLES + lag), TURNS)),
            shared: core::array::from_fn(|lag| {
                SlowLag::new(&part(1 + lag, heat.shared[1 + lag]), TURNS)
            }),
            input_gain,
            per_input_gain: 1.0 / input_gain,
            fast_weight: own_fast.iter().map(|lag| lag.weight).sum(),
            beam_lag: heat.beam_lag.0 / TICK.0,
            stored_per_k2: 0.5 * heat.time_growth.0 / TICK.0,
        }
    }

    /// The rise of a heater whose beam goes from `before` to `beam` in a tick: with the difference for the slope, the inverse of its lag.
    #[inline(always)]
    pub(crate) fn heater(&self, beam: Kelvin, before: Kelvin) -> Kelvin {
        Kelvin(beam.0 + self.beam_lag * (beam.0 - before.0))
    }

    /// The heating for which the temperature rise is `target` after the next tick: what power at rest
    /// would make in the end.
    pub(crate) fn heating(&self, state: &HeatState, target: Kelvin) -> Kelvin {
        Kelvin((target.0 - state.free_response) * self.per_input_gain)
    }

    /// The heating that an actuator stores besides on its way from one rise to another in a tick.
    #[inline(always)]
    pub(crate) fn stored(&self, from: Kelvin, to: Kelvin) -> Kelvin {
        Kelvin(self.stored_per_k2 * (to.0 * to.0 - from.0 * from.0))
    }

    /// What of a heating goes to the poles, at a rise `from`. How much is stored depends on the rise that comes of it: a step of the secant
    /// method from where nothing is.
    #[inline(always)]
    pub(crate) fn unstored(&self, state: &HeatState, heating: Kelvin, from: Kelvin) -> Kelvin {
        let unslowed = self.rise(state, heating);
        let slowing = self.input_gain * self.stored_per_k2 * (unslowed.0 + from.0);
        let slowing = if slowing > LEAST_SLOWING {
            slowing
        } else {
            LEAST_SLOWING
        };
        let stored = (unslowed.0 - from.0) * slowing / (1.0 + slowing);
        Kelvin(heating.0 - stored * self.per_input_gain)
    }

    /// Temperatures of an actuator that was followed with other poles: each has warmed as far as the one in its place.
    pub(crate) fn inherit(
        &self,
        shared: &SharedHeat,
        (before, state): (&Self, &HeatState),
    ) -> HeatState {
        let mut inherited = HeatState {
            fast: core::array::from_fn(|k| self.fast[k].inherit(&before.fast[k], state.fast[k])),
            slow: core::array::from_fn(|k| self.slow[k].inherit(&before.slow[k], &state.slow[k])),
            heating: state.heating,
            ..HeatState::default()
        };
        inherited.sum_up(shared);
        inherited
    }

    /// What four actuators share that were followed with other poles, the same way.
    pub(crate) fn inherit_shared(&self, before: &Self, shared: &SharedHeat) -> SharedHeat {
        let lags = self.shared.each_ref();
        let ahead: [f32; SHARED_POLES] =
            core::array::from_fn(|k| shared.ahead[k] * lags[k].part(&before.shared[k]));
        SharedHeat {
            lags: core::array::from_fn(|k| lags[k].inherit(&before.shared[k], &shared.lags[k])),
            ahead,
            sum: ahead.iter().sum(),
            ..shared.clone()
        }
    }

    /// Whether every lag is less than so far from zero (K).
    pub(crate) fn is_at_rest(state: &HeatState, shared: &SharedHeat, least: f32) -> bool {
        let slow = state.slow.iter().chain(&shared.lags);
        let mut all = state.fast.iter().copied().chain(slow.map(|lag| lag.value));
        all.all(|at| at.abs() < least)
    }

    /// Temperature rise at the end of a tick with this heating.
    pub(crate) fn rise(&self, state: &HeatState, heating: Kelvin) -> Kelvin {
        Kelvin(state.free_response + self.input_gain * heating.0)
    }

    /// A tick with the heating that was really there; returns the temperature rise at its end.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut HeatState, heating: Kelvin) -> Kelvin {
        let rise = self.rise(state, heating);
        state.heating += heating.0;
        let lags = self.fast.iter().zip(&mut state.fast);
        let fast = lags.map(|(lag, at)| lag.advance(at, heating.0));
        state.free_response = fast.fold(state.slow_sum, |sum, at| sum + at);
        rise
    }

    /// What the fast poles have still to bring at the heating of the last ticks, just before the slow ones' turn.
    pub(crate) fn unsettled(&self, state: &HeatState, shared: &SharedHeat, rise: Kelvin) -> Kelvin {
        let mean = state.heating * (1.0 / (TURNS - 1) as f32);
        Kelvin(self.fast_weight * mean - (rise.0 - state.slow_sum) + shared.unsettled)
    }

    /// The slow lags' turn of the actuator whose turn it is, after every [`TURNS`]th tick, and that of one lag that is shared.
    #[inline(always)]
    pub(crate) fn advance_slow(&self, state: &mut HeatState, shared: &mut SharedHeat, turn: usize) {
        let mean = state.heating * (1.0 / TURNS as f32);
        state.heating = 0.0;
        self.advance_shared(shared, mean, turn);
        let before = state.slow_sum;
        state.slow_sum = shared.sum;
        for (lag, at) in self.slow.iter().zip(&mut state.slow) {
            lag.advance(at, mean);
            state.slow_sum += at.value;
        }
        state.free_response += state.slow_sum - before;
    }

    /// One shared lag, with the mean heating of all four; `mean` is that of the actuator whose turn it is.
    #[inline(always)]
    fn advance_shared(&self, shared: &mut SharedHeat, mean: f32, turn: usize) {
        let turn = turn % SHARED_POLES;
        let (lag, at) = (&self.shared[turn], &mut shared.lags[turn]);
        lag.advance(at, shared.heating);
        let ahead = at.value + AHEAD / TURNS as f32 * lag.step(at, shared.heating);
        shared.ahead[turn] = ahead;
        shared.sum = shared.ahead.iter().sum();
        shared.gathered += mean;
        if turn + 1 == SHARED_POLES {
            shared.heating = shared.gathered * (1.0 / CHANNELS as f32);
            shared.gathered = 0.0;
            let lags = self.shared.iter().zip(&shared.lags).take(SHARED_FAST);
            let left = lags.map(|(lag, at)| lag.left(at, shared.heating));
            shared.unsettled = left.sum();
        }
    }
}

impl HeatState {
    /// An actuator whose poles are here (K), the fast ones first.
    pub(crate) fn of(poles: [f32; POLES], shared: &SharedHeat) -> Self {
        let mut state = Self {
            fast: core::array::from_fn(|pole| poles[pole]),
            slow: core::array::from_fn(|pole| SlowState::at(poles[FAST_POLES + pole])),
            ..Self::default()
        };
        state.sum_up(shared);
        state
    }

    /// Where its own part of the poles is (K), the fast ones first.
    pub(crate) fn held(&self) -> [f32; POLES] {
        let slow = self.slow.map(|lag| lag.value);
        let mut poles = self.fast.into_iter().chain(slow);
        core::array::from_fn(|_| poles.next().unwrap_or_default())
    }

    /// The temperature rise without heating.
    pub(crate) fn free_response(&self) -> Kelvin {
        Kelvin(self.free_response)
    }

    /// What all its lags bring together, once they have been set.
    fn sum_up(&mut self, shared: &SharedHeat) {
        self.slow_sum = shared.sum + self.slow.iter().map(|lag| lag.value).sum::<f32>();
        self.free_response = self.fast.iter().sum::<f32>() + self.slow_sum;
    }

    /// Free responses of the fast poles one tick ahead, with what of them is shared, and what the slow ones bring.
    pub(crate) fn parts(&self, shared: &SharedHeat) -> ([f32; FAST_POLES], f32) {
        let [_, quick @ ..] = self.fast;
        let mut fast = self.fast;
        let mut shared_fast = 0.0;
        for ((at, own), shared) in fast.iter_mut().skip(1).zip(quick).zip(&shared.lags) {
            *at = own + shared.value;
            shared_fast += shared.value;
        }
        (fast, self.slow_sum - shared_fast)
    }
}

impl SharedHeat {
    /// What four actuators share whose poles are here (K), all but the first.
    pub(crate) fn of(poles: [f32; SHARED_POLES]) -> Self {
        Self {
            lags: poles.map(SlowState::at),
            ahead: poles,
            sum: poles.iter().sum(),
            ..Self::default()
        }
    }

    /// What is shared of the poles (K), all but the first.
    pub(crate) fn held(&self) -> [f32; SHARED_POLES] {
        self.lags.map(|lag| lag.value)
    }
}

// A shared lag has its turn with an actuator's.
const _: () = assert!(SHARED_POLES == TURNS && CHANNELS == TURNS);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use crate::units::{Second, SecondPerKelvin};
    use proptest::prelude::*;

    /// Heat of which nothing is shared.
    fn apart() -> Heat {
        Heat {
            shared: Heat::INSTANT.shared,
            ..parts().heat
        }
    }

    /// The lags forward, in f64, with the slow ones' turns.
    struct Forward {
        heat: Heat,
        fast: [f64; FAST_POLES],
        slow: [f64; SLOW_POLES],
        heating: f64,
    }

    impl Forward {
        fn new() -> Self {
            Self {
                heat: apart(),
                fast: [0.0; FAST_POLES],
                slow: [0.0; SLOW_POLES],
                heating: 0.0,
            }
        }

        /// A tick, and the slow lags' turn after it.
        fn step(&mut self, heating: f64, turn: bool) -> f64 {
            let relax = |lag: &crate::calibration::Lag, at: &mut f64, input: f64, ticks: f64| {
                let goal = f64::from(lag.weight) * input;
                *at = goal + (*at - goal) * (-1e-4 * ticks / f64::from(lag.time.0)).exp();
            };
            let rested: f64 = self.slow.iter().sum();
            for (lag, at) in self.heat.fast.iter().zip(&mut self.fast) {
                relax(lag, at, heating, 1.0);
            }
            self.heating += heating;
            if turn {
                for (lag, at) in self.heat.slow.iter().zip(&mut self.slow) {
                    relax(lag, at, self.heating / TURNS as f64, TURNS as f64);
                }
                self.heating = 0.0;
            }
            rested + self.fast.iter().sum::<f64>()
        }
    }

    proptest! {
        #[test]
        fn the_inverse_is_exact_along_any_course(
            course in proptest::collection::vec(0.0_f32..100.0, 1..100),
        ) {
            let inverse = HeatInverse::new(&apart());
            let mut state = HeatState::default();
            let mut mirror = Forward::new();
            for (tick, target) in course.into_iter().enumerate() {
                let turn = tick % TURNS == 3;
                let heating = inverse.heating(&state, Kelvin(target));
                inverse.advance(&mut state, heating);
                if turn {
                    inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
                }
                let reached = mirror.step(f64::from(heating.0), turn);
                // Sums in f32: some forty roundings of 100 K.
                prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
            }
        }

        /// Whatever is driven and however the time constants change, also beyond what a calibration was checked for.
        #[test]
        fn any_heating_leaves_a_temperature(
            growth_s_per_k in -1e-3_f32..1e-3,
            driven in proptest::collection::vec(0.0_f32..1e4, 1..300),
        ) {
            let heat = Heat { time_growth: SecondPerKelvin(growth_s_per_k), ..apart() };
            let inverse = HeatInverse::new(&heat);
            let (mut state, mut rise) = (HeatState::default(), Kelvin(0.0));
            for heating in driven {
                let left = inverse.unstored(&state, Kelvin(heating), rise);
                rise = inverse.advance(&mut state, left);
                prop_assert!(rise.0.is_finite() && rise.0.abs() < 1e6, "{rise}");
            }
        }

        /// Whatever a limit made of the heating before, the next tick that it leaves free is exact.
        #[test]
        fn nothing_winds_up_behind_a_limit(
            limited in proptest::collection::vec(0.0_f32..120.0, 0..300),
            target in 0.0_f32..100.0,
        ) {
            let inverse = HeatInverse::new(&apart());
            let mut state = HeatState::default();
            let mut mirror = Forward::new();
            for heating in limited {
                inverse.advance(&mut state, Kelvin(heating));
                inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
                mirror.step(f64::from(heating), true);
            }
            let heating = inverse.heating(&state, Kelvin(target));
            let reached = mirror.step(f64::from(heating.0), false);
            // As above.
            prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
        }
    }

    /// What four actuators share, along a sine of each at 20 Hz, against the lags in f64 that the mean heating drives at every tick.
    #[test]
    fn what_is_shared_is_followed_in_turns() {
        let heat = Heat {
            fast: [
                Lag {
                    weight: 0.6,
                    time: Second(1e-3),
                },
                Lag {
                    weight: 0.3,
                    time: Second(33e-3),
                },
                Lag::NONE,
            ],
            slow: [
                Lag {
                    weight: 0.1,
                    time: Second(4.7),
                },
                Lag {
                    weight: 0.0,
                    time: Second(1.0),
                },
            ],
            shared: [0.0, 1.0, 0.0, 0.8, 0.0],
            ..Heat::INSTANT
        };
        let inverse = HeatInverse::new(&heat);
        let mut states: [HeatState; CHANNELS] = Default::default();
        let mut shared = SharedHeat::default();
        let (mut fast, mut slow) = (0.0_f64, 0.0_f64);
        let mut own = [[0.0_f64; 2]; CHANNELS];
        let mut worst = 0.0_f64;
        let relax = |at: &mut f64, goal: f64, time: f64| {
            *at = goal + (*at - goal) * (-1e-4 / time).exp();
        };
        for tick in 0..40_000_usize {
            let phase = core::f64::consts::TAU * 20.0 * 1e-4 * tick as f64;
            let swing = 20.0 * libm::sin(phase);
            let targets: [f64; CHANNELS] =
                core::array::from_fn(|i| 60.0 + (0.5 + 0.25 * i as f64) * swing);
            let mut heatings = [0.0; CHANNELS];
            for i in 0..CHANNELS {
                let heating = inverse.heating(&states[i], Kelvin(targets[i] as f32));
                inverse.advance(&mut states[i], heating);
                heatings[i] = f64::from(heating.0);
            }
            let turn = tick % TURNS;
            inverse.advance_slow(&mut states[turn], &mut shared, turn);
            let mean = heatings.iter().sum::<f64>() / CHANNELS as f64;
            relax(&mut fast, 0.3 * mean, 33e-3);
            relax(&mut slow, 0.08 * mean, 4.7);
            for i in 0..CHANNELS {
                relax(&mut own[i][0], 0.6 * heatings[i], 1e-3);
                relax(&mut own[i][1], 0.02 * heatings[i], 4.7);
                let rise = own[i][0] + own[i][1] + fast + slow;
                // After the first jump from rest.
                if tick > 1000 {
                    worst = worst.max((rise - targets[i]).abs());
                }
            }
        }
        // What is shared goes by up to 0.03 K in a tick here, and is told once in four.
        assert!(worst < 0.1, "{worst} K");
    }

    /// A beam behind its heater along a smooth way, as f64 follows a heater that warms straight within each tick.
    #[test]
    fn a_heater_that_is_led_takes_its_beam_along_the_way() {
        const TICKS: usize = 70;
        let inverse = HeatInverse::new(&parts().heat);
        let lag = f64::from(parts().heat.beam_lag.0) / 1e-4;
        let (pole, mean) = ((-1.0 / lag).exp(), lag * -(-1.0 / lag).exp_m1());
        let (mut asked, mut heater, mut beam) = (Kelvin(0.0), 0.0, 0.0);
        for tick in 1..=2 * TICKS {
            let done = (tick as f64 / TICKS as f64).min(1.0);
            let next = Kelvin((100.0 * done.powi(3) * (10.0 - done * (15.0 - 6.0 * done))) as f32);
            let led = f64::from(inverse.heater(next, asked).0);
            beam = pole * beam + (mean - pole) * heater + (1.0 - mean) * led;
            (heater, asked) = (led, next);
            // The slope's difference is half a tick old: lag / 2 of the second difference, at most 5.8 of 100 K in 70 ticks squared.
            let most = 0.5 * lag * 5.8 * 100.0 / (TICKS as f64).powi(2);
            assert!((beam - f64::from(next.0)).abs() < most, "tick {tick}");
        }
        assert!((beam - 100.0).abs() < 1e-3);
    }

    /// A heater along a smooth way, whose time constant grows by half over it, as f64 follows it in hundredths of a tick.
    #[test]
    fn a_heater_that_slows_as_it_warms_is_where_it_is_asked_to_be() {
        const TICKS: usize = 70;
        const SUBSTEPS: usize = 100;
        let (time_s, growth_s_k) = (2e-3, 1e-5);
        let mut heat = Heat {
            time_growth: SecondPerKelvin(growth_s_k as f32),
            ..Heat::INSTANT
        };
        heat.fast[0].time = Second(time_s as f32);
        let inverse = HeatInverse::new(&heat);
        let (mut state, mut core, mut mirror) = (HeatState::default(), Kelvin(0.0), 0.0_f64);
        for tick in 1..=2 * TICKS {
            let done = (tick as f64 / TICKS as f64).min(1.0);
            let asked = Kelvin((100.0 * done.powi(3) * (10.0 - done * (15.0 - 6.0 * done))) as f32);
            let heating = inverse.heating(&state, asked);
            let whole = Kelvin(heating.0 + inverse.stored(core, asked).0);
            let found = inverse.unstored(&state, whole, core);
            // Of what the square of a tick's way stores, 0.05 / K of 2.7 K, a step of the secant method leaves the part by which storing slows
            // the way: a quarter, 2 x 0.05 x 0.05 x 64 of itself and one.
            assert!((found.0 - heating.0).abs() < 0.09, "{found} for {heating}");
            inverse.advance(&mut state, heating);
            core = asked;
            for _ in 0..SUBSTEPS {
                let slope = (f64::from(whole.0) - mirror) / (time_s + growth_s_k * mirror);
                mirror += slope * 1e-4 / SUBSTEPS as f64;
            }
            // Within a tick the heating is held and the rise is not straight: a tick over twice the time constant of a tick's way.
            let most = 2.7 * 1e-4 / (2.0 * time_s);
            assert!(
                (mirror - f64::from(asked.0)).abs() < most,
                "tick {tick}: {mirror} for {asked}"
            );
        }
    }

    #[test]
    fn without_poles_heating_is_temperature() {
        let inverse = HeatInverse::new(&Heat::INSTANT);
        let state = HeatState::default();
        assert_eq!(inverse.heating(&state, Kelvin(42.0)), Kelvin(42.0));
    }
}
