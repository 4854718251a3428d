//! First-order lags, sampled: what the stages `heat` and `memory` are made of.
//!
//! A quick lag is advanced at every tick. A slow one hardly moves in one, and has its turn only now and then; that saves the
//! control tick a third.

use crate::calibration::Lag;
use crate::design::TICK;
use crate::units::Second;
use libm::expm1f;

/// Ticks from one turn of an actuator's slow thermal poles to the next.
pub(crate) const TURNS: usize = 4;

/// Input gain of a lag of unit weight over so many ticks, for an input that is held (zero-order hold):
/// 1 - exp(-T / time). Its pole is 1 less that.
pub(crate) fn rate(time: Second, ticks: usize) -> f32 {
    if time.0 > 0.0 {
        -expm1f(-TICK.0 * ticks as f32 / time.0)
    } else {
        1.0
    }
}

/// A quick lag. Its state is its free response one tick ahead: where it will be without input.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct QuickLag {
    /// Pole of the sampled lag: exp(-T / time).
    pole: f32,
    /// Gain from an input that is held for a tick to the value after it.
    pub(crate) input_gain: f32,
}

impl QuickLag {
    pub(crate) fn new(lag: &Lag) -> Self {
        let rate = rate(lag.time, 1);
        Self {
            pole: 1.0 - rate,
            input_gain: lag.weight * rate,
        }
    }

    /// Pole of the sampled lag.
    pub(crate) fn pole(&self) -> f32 {
        self.pole
    }

    /// What it comes to for an input of one.
    pub(crate) fn weight(&self) -> f32 {
        self.input_gain / (1.0 - self.pole)
    }

    /// A tick with `input`; returns the new state, which is `free_response`.
    pub(crate) fn advance(&self, free_response: &mut f32, input: f32) -> f32 {
        *free_response = self.pole * (*free_response + self.input_gain * input);
        *free_response
    }
}

/// A slow lag.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SlowLag {
    /// Part of the way that it goes from turn to turn.
    rate: f32,
    weight: f32,
}

/// Where a slow lag is, weight included.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SlowState {
    pub(crate) value: f32,
    /// What `value` was too coarse to take. A lag of many seconds goes less than a rounding error.
    remainder: f32,
}

impl SlowState {
    /// One that is here.
    pub(crate) fn at(value: f32) -> Self {
        Self {
            value,
            remainder: 0.0,
        }
    }
}

impl SlowLag {
    /// One that has its turn every so many ticks.
    pub(crate) fn new(lag: &Lag, ticks: usize) -> Self {
        Self {
            rate: rate(lag.time, ticks),
            weight: lag.weight,
        }
    }

    /// Part of the way that it goes from turn to turn.
    pub(crate) fn rate(&self) -> f32 {
        self.rate
    }

    /// What it comes to for an input of one.
    pub(crate) fn weight(&self) -> f32 {
        self.weight
    }

    /// How far it has still to go at this input.
    pub(crate) fn left(&self, state: &SlowState, input: f32) -> f32 {
        self.weight * input - state.value
    }

    /// How far it goes in a turn at this input.
    pub(crate) fn step(&self, state: &SlowState, input: f32) -> f32 {
        self.rate * self.left(state, input)
    }

    /// A turn with the mean of the input since the last one.
    pub(crate) fn advance(&self, state: &mut SlowState, input: f32) {
        let step = self.step(state, input) + state.remainder;
        let value = state.value + step;
        state.remainder = step - (value - state.value);
        state.value = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_slow_lag_follows_the_exponential_however_slow(
            time in 0.1_f32..100.0,
            weight in 0.01_f32..1.0,
            input in -100.0_f32..100.0,
        ) {
            let lag = SlowLag::new(&Lag { weight, time: Second(time) }, TURNS);
            let mut state = SlowState::default();
            for _ in 0..20_000 / TURNS {
                lag.advance(&mut state, input);
            }
            let left = (-2.0 / f64::from(time)).exp();
            let exact = f64::from(weight) * f64::from(input) * (1.0 - left);
            let error = f64::from(state.value) - exact;
            // Rate, weight and what is left to go are rounded in f32, by 6e-8 each: thirty of these.
            prop_assert!(error.abs() < 2e-6 * f64::from(input).abs() + 1e-6, "{error}");
        }

        #[test]
        fn a_quick_lag_is_exact_for_an_input_that_is_held(
            time in 1e-4_f32..0.25,
            input in -100.0_f32..100.0,
        ) {
            let lag = QuickLag::new(&Lag { weight: 1.0, time: Second(time) });
            let mut free_response = 0.0;
            for _ in 0..1000 {
                lag.advance(&mut free_response, input);
            }
            let value = free_response + lag.input_gain * input;
            let exact = f64::from(input) * (1.0 - (-0.1001 / f64::from(time)).exp());
            // A thousand roundings of f32 of one sign.
            prop_assert!((f64::from(value) - exact).abs() < 1e-4 * (1.0 + f64::from(input).abs()));
        }
    }

    #[test]
    fn without_a_time_constant_it_is_at_once() {
        let lag = QuickLag::new(&Lag {
            weight: 0.5,
            time: Second(0.0),
        });
        let mut free_response = 0.0;
        lag.advance(&mut free_response, 8.0);
        assert_eq!((free_response, lag.input_gain), (0.0, 0.5));
    }
}
