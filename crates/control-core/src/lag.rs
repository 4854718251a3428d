//! First-order lags, sampled: what the stages `heat` and `memory` are made of.

use crate::calibration::Lag;
use crate::units::Second;
use libm::expm1f;

/// Length of a control tick. Both boards tick ten thousand times a second.
pub const TICK: Second = Second(1e-4);

/// A lag at the control rate. Its input is held for a tick, so that this is exact.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SampledLag {
    /// Part of the way to its input that it goes in a tick, 1 - exp(-tick / time constant).
    rate: f32,
    /// Its weight in the sum.
    weight: f32,
}

/// Where a lag is, weight included.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LagState {
    value: f32,
    /// What `value` was too coarse to take. A lag of many seconds goes less than a rounding error a tick.
    remainder: f32,
}

impl SampledLag {
    pub(crate) fn new(lag: &Lag) -> Self {
        let rate = if lag.time.0 > 0.0 {
            -expm1f(-TICK.0 / lag.time.0)
        } else {
            1.0
        };
        Self {
            rate,
            weight: lag.weight,
        }
    }

    /// How much of an input is there after a tick.
    pub(crate) fn gain(&self) -> f32 {
        self.rate * self.weight
    }

    /// Where it will be after a tick without input.
    pub(crate) fn coast(&self, state: &LagState) -> f32 {
        state.value - self.rate * state.value
    }

    /// A tick with `input`.
    pub(crate) fn advance(&self, state: &mut LagState, input: f32) {
        let step = self.rate * (self.weight * input - state.value) + state.remainder;
        let value = state.value + step;
        state.remainder = step - (value - state.value);
        state.value = value;
    }
}

impl LagState {
    pub(crate) fn value(&self) -> f32 {
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn follows_the_exponential_however_slow(
            time in 1e-3_f32..100.0,
            weight in 0.01_f32..1.0,
            input in -100.0_f32..100.0,
        ) {
            let lag = SampledLag::new(&Lag { weight, time: Second(time) });
            let mut state = LagState::default();
            for _ in 0..20_000 {
                lag.advance(&mut state, input);
            }
            let left = (-2.0 / f64::from(time)).exp();
            let exact = f64::from(weight) * f64::from(input) * (1.0 - left);
            let error = f64::from(state.value()) - exact;
            prop_assert!(error.abs() < 2e-6 * f64::from(input).abs() + 1e-6, "{error}");
        }
    }

    #[test]
    fn without_a_time_constant_it_is_at_once() {
        let lag = SampledLag::new(&Lag {
            weight: 0.5,
            time: Second(0.0),
        });
        let mut state = LagState::default();
        lag.advance(&mut state, 8.0);
        assert_eq!((state.value(), lag.gain()), (4.0, 0.5));
    }
}
