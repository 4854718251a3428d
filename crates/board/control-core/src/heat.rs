//! The stage `heat` inverted: the heating that takes the temperature in one tick to where it must be.
//!
//! The lags' states are those of the mirror itself, advanced with what was really driven. So what a
//! limit cut off is asked for again in the next tick, and nothing winds up (anti-windup by state
//! feedback of the saturated input).
//!
//! A part of a pole may be driven by the heating of all four actuators, each in proportion to its watts, as that of the frame they stand on,
//! which an actuator that loses more warms by more for the same rise. It is slow against a
//! tick, so what the four have in common is brought up to date pole by pole, told ahead by as much as it is late, and taken into each
//! actuator's turn; with that the four are inverted apart, and their coupling needs no inverse of its own.
//!
//! The poles tell the heater's temperature. The beam follows it with a lag of its own, so on its way the heater is asked to be ahead.
//! Time constants may grow with the rise, and be longer for one actuator than for the others: on its way it then takes besides what a
//! growing or larger heat capacity would store.

use crate::CHANNELS;
use crate::calibration::{FAST_POLES, Heat, Lag, POLES, SLOW_POLES};
use crate::design::TICK;
use crate::lag::{QuickLag, SlowLag, SlowState, TURNS};
use crate::units::Kelvin;

mod followed;
pub(crate) mod inherited;

use followed::{followed, slow};

/// The numbers of the inverse.
#[derive(Clone, Debug)]
pub(crate) struct HeatInverse {
    fast: [QuickLag; FAST_POLES],
    slow: [SlowLag; SLOW_POLES],
    shared: [SlowLag; SHARED_POLES],
    /// What a kelvin of each actuator's heating adds to what drives them.
    shared_gains: [f32; CHANNELS],
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
    /// What drives them: the mean of all four's heating in their last turns, by their watts.
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

/// What time constants may have grown by at the least, over what they are without any rise: some of each must be left. A calibration is
/// checked for it up to its highest rise, and a drive may heat beyond.
pub(crate) const LEAST_SLOWING: f32 = -0.9;

impl HeatInverse {
    /// `shared_gains`: what a kelvin of each actuator's heating adds to what drives the shared poles.
    pub(crate) fn new(heat: &Heat, shared_gains: [f32; CHANNELS]) -> Self {
        let poles = followed(heat);
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
            slow: core::array::from_fn(|lag| slow(own(FAST_POLES + lag))),
            shared: core::array::from_fn(|lag| slow(part(1 + lag, heat.shared[1 + lag]))),
            shared_gains,
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

    /// The heating that an actuator which is `slower` by so many ticks stores besides on its way from one rise to another in a tick.
    #[inline(always)]
    pub(crate) fn stored(&self, slower: f32, from: Kelvin, to: Kelvin) -> Kelvin {
        Kelvin((to.0 - from.0) * (slower + self.stored_per_k2 * (to.0 + from.0)))
    }

    /// What drives the shared poles where the four are heated so.
    pub(crate) fn shared_heating(&self, heatings: &[Kelvin; CHANNELS]) -> Kelvin {
        let each = self.shared_gains.iter().zip(heatings);
        Kelvin(each.map(|(gain, heating)| gain * heating.0).sum())
    }

    /// What of a heating goes to the poles, at a rise `from`, and the rise at the end of the tick. How much is stored depends on that: a step of
    /// the secant method from where nothing is.
    #[inline(always)]
    pub(crate) fn unstored(
        &self,
        slower: f32,
        state: &HeatState,
        heating: Kelvin,
        from: Kelvin,
    ) -> (Kelvin, Kelvin) {
        let unslowed = self.rise(state, heating);
        let slower = slower + self.stored_per_k2 * (unslowed.0 + from.0);
        let mut slowed = 1.0 + self.input_gain * slower;
        // Not so for NaN.
        let is_plausible = slowed > 1.0 + LEAST_SLOWING;
        if !is_plausible {
            slowed = 1.0 + LEAST_SLOWING;
        }
        let rise = Kelvin(from.0 + (unslowed.0 - from.0) / slowed);
        (self.heating(state, rise), rise)
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

    /// One shared lag, with what drives all of them; `mean` is the heating of the actuator whose turn it is.
    #[inline(always)]
    fn advance_shared(&self, shared: &mut SharedHeat, mean: f32, turn: usize) {
        let turn = turn % SHARED_POLES;
        let (lag, at) = (&self.shared[turn], &mut shared.lags[turn]);
        lag.advance(at, shared.heating);
        let ahead = at.value + AHEAD / TURNS as f32 * lag.step(at, shared.heating);
        shared.ahead[turn] = ahead;
        shared.sum = shared.ahead.iter().sum();
        shared.gathered += self.shared_gains[turn] * mean;
        if turn + 1 == SHARED_POLES {
            shared.heating = shared.gathered;
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
mod tests;
