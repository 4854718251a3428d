//! The stage `heat` inverted: the heating that takes the temperature in one tick to where it must be.
//!
//! The lags' states are those of the mirror itself, advanced with what was really driven. So what a
//! limit cut off is asked for again in the next tick, and nothing winds up (anti-windup by state
//! feedback of the saturated input).

use crate::calibration::{FAST_POLES, Heat, SLOW_POLES};
use crate::lag::{QuickLag, SlowLag, SlowState, TURNS};
use crate::units::Kelvin;

/// The numbers of the inverse.
#[derive(Clone, Debug)]
pub(crate) struct HeatInverse {
    fast: [QuickLag; FAST_POLES],
    slow: [SlowLag; SLOW_POLES],
    /// Input gain of all poles over one tick, and its inverse.
    input_gain: f32,
    per_input_gain: f32,
    /// Weight of the fast poles together.
    fast_weight: f32,
}

/// Temperatures of the lags of one actuator.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeatState {
    fast: [f32; FAST_POLES],
    slow: [SlowState; SLOW_POLES],
    slow_sum: f32,
    /// Heating since the slow ones' last turn.
    heating: f32,
    /// The free response one tick ahead: the temperature rise without heating.
    free_response: f32,
}

impl HeatInverse {
    pub(crate) fn new(heat: &Heat) -> Self {
        let fast = heat.fast.each_ref().map(QuickLag::new);
        let input_gain = fast.iter().map(|lag| lag.input_gain).sum::<f32>();
        Self {
            fast,
            slow: heat.slow.each_ref().map(|lag| SlowLag::new(lag, TURNS)),
            input_gain,
            per_input_gain: 1.0 / input_gain,
            fast_weight: heat.fast.iter().map(|lag| lag.weight).sum(),
        }
    }

    /// The heating for which the temperature rise is `target` after the next tick: what power at rest
    /// would make in the end.
    pub(crate) fn heating(&self, state: &HeatState, target: Kelvin) -> Kelvin {
        Kelvin((target.0 - state.free_response) * self.per_input_gain)
    }

    /// Whether every lag is less than so far from zero (K).
    pub(crate) fn is_at_rest(state: &HeatState, least: f32) -> bool {
        let slow = state.slow.iter().map(|lag| lag.value);
        let mut all = state.fast.iter().copied().chain(slow);
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
    pub(crate) fn unsettled(&self, state: &HeatState, rise: Kelvin) -> Kelvin {
        let mean = state.heating * (1.0 / (TURNS - 1) as f32);
        Kelvin(self.fast_weight * mean - (rise.0 - state.slow_sum))
    }

    /// The slow lags' turn, after every [`TURNS`]th tick.
    pub(crate) fn advance_slow(&self, state: &mut HeatState) {
        let mean = state.heating * (1.0 / TURNS as f32);
        state.heating = 0.0;
        let before = state.slow_sum;
        state.slow_sum = 0.0;
        for (lag, at) in self.slow.iter().zip(&mut state.slow) {
            lag.advance(at, mean);
            state.slow_sum += at.value;
        }
        state.free_response += state.slow_sum - before;
    }
}

impl HeatState {
    /// Free responses of the fast poles one tick ahead, and what the slow ones bring.
    pub(crate) fn parts(&self) -> (&[f32; FAST_POLES], f32) {
        (&self.fast, self.slow_sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use proptest::prelude::*;

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
                heat: parts().heat,
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
            let inverse = HeatInverse::new(&parts().heat);
            let mut state = HeatState::default();
            let mut mirror = Forward::new();
            for (tick, target) in course.into_iter().enumerate() {
                let turn = tick % TURNS == 3;
                let heating = inverse.heating(&state, Kelvin(target));
                inverse.advance(&mut state, heating);
                if turn {
                    inverse.advance_slow(&mut state);
                }
                let reached = mirror.step(f64::from(heating.0), turn);
                prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
            }
        }

        /// Whatever a limit made of the heating before, the next tick that it leaves free is exact.
        #[test]
        fn nothing_winds_up_behind_a_limit(
            limited in proptest::collection::vec(0.0_f32..120.0, 0..300),
            target in 0.0_f32..100.0,
        ) {
            let inverse = HeatInverse::new(&parts().heat);
            let mut state = HeatState::default();
            let mut mirror = Forward::new();
            for heating in limited {
                inverse.advance(&mut state, Kelvin(heating));
                inverse.advance_slow(&mut state);
                mirror.step(f64::from(heating), true);
            }
            let heating = inverse.heating(&state, Kelvin(target));
            let reached = mirror.step(f64::from(heating.0), false);
            prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
        }
    }

    #[test]
    fn without_poles_heating_is_temperature() {
        let inverse = HeatInverse::new(&Heat::INSTANT);
        let state = HeatState::default();
        assert_eq!(inverse.heating(&state, Kelvin(42.0)), Kelvin(42.0));
    }
}
