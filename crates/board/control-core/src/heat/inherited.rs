//! How warm the poles of a calibration are that takes the place of another one: as warm as poles of their times would have become that
//! followed the same powers.

use super::{AHEAD, HeatInverse, HeatState, SHARED_POLES, SharedHeat};
use crate::between::Between;
use crate::calibration::{FAST_POLES, SLOW_POLES};
use crate::lag::{SlowLag, SlowState, TURNS};
use crate::units::Kelvin;

/// What each pole goes on with: the two of the poles before between which it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PolesBefore {
    fast: [Between; FAST_POLES],
    slow: [Between; SLOW_POLES],
    shared: [Between; SHARED_POLES],
}

impl HeatInverse {
    /// Which of the poles of the one before these go on with.
    pub(crate) fn poles_before(&self, before: &Self) -> PolesBefore {
        // A fast pole that weighs nothing was not followed.
        let rates = before.fast.each_ref().map(|lag| match lag.weight() > 0.0 {
            true => 1.0 - lag.pole(),
            false => f32::NAN,
        });
        let fast = self.fast.each_ref();
        PolesBefore {
            fast: fast.map(|lag| Between::of_rate(1.0 - lag.pole(), &rates)),
            slow: among(&self.slow, &before.slow),
            shared: among(&self.shared, &before.shared),
        }
    }

    /// Temperatures of an actuator that was followed with other poles. `worth`: what a heating is now that was this much before.
    pub(crate) fn inherit(
        &self,
        shared: &SharedHeat,
        (from, before, state): (&PolesBefore, &Self, &HeatState),
        worth: impl Fn(Kelvin) -> Kelvin,
    ) -> HeatState {
        let followed: [f32; FAST_POLES] = core::array::from_fn(|k| {
            let weight = before.fast[k].weight();
            if weight > 0.0 {
                state.fast[k] / weight
            } else {
                0.0
            }
        });
        let slow = inputs(&before.slow, &state.slow);
        let now = |input: f32| worth(Kelvin(input)).0;
        let mut inherited = HeatState {
            fast: core::array::from_fn(|k| {
                self.fast[k].weight() * now(from.fast[k].among(&followed))
            }),
            slow: core::array::from_fn(|k| {
                SlowState::at(self.slow[k].weight() * now(from.slow[k].among(&slow)))
            }),
            heating: state.heating,
            ..HeatState::default()
        };
        inherited.sum_up(shared);
        inherited
    }

    /// What four actuators share that were followed with other poles, the same way.
    pub(crate) fn inherit_shared(
        &self,
        (from, before, shared): (&PolesBefore, &Self, &SharedHeat),
        worth: impl Fn(Kelvin) -> Kelvin,
    ) -> SharedHeat {
        let followed = inputs(&before.shared, &shared.lags);
        let now = |input: f32| worth(Kelvin(input)).0;
        let heating = now(shared.heating);
        let lags: [SlowState; SHARED_POLES] = core::array::from_fn(|k| {
            SlowState::at(self.shared[k].weight() * now(from.shared[k].among(&followed)))
        });
        let ahead: [f32; SHARED_POLES] = core::array::from_fn(|k| {
            lags[k].value + AHEAD / TURNS as f32 * self.shared[k].step(&lags[k], heating)
        });
        SharedHeat {
            lags,
            ahead,
            sum: ahead.iter().sum(),
            heating,
            ..shared.clone()
        }
    }
}

fn among<const N: usize>(lags: &[SlowLag; N], before: &[SlowLag; N]) -> [Between; N] {
    let rates = before.each_ref().map(SlowLag::rate);
    lags.each_ref()
        .map(|lag| Between::of_rate(lag.rate(), &rates))
}

/// What lags would come to that weigh one.
fn inputs<const N: usize>(lags: &[SlowLag; N], states: &[SlowState; N]) -> [f32; N] {
    core::array::from_fn(|k| states[k].value / lags[k].weight())
}
