//! The stage `heat` inverted: the heating that takes the temperature in one tick to where it must be.
//!
//! The lags' states are those of the mirror itself, advanced with what was really driven. So what a
//! limit cut off is asked for again in the next tick, and nothing winds up.

use crate::calibration::{FAST_POLES, Heat, SLOW_POLES};
use crate::lag::{LagState, SampledLag};
use crate::units::Kelvin;

const POLES: usize = FAST_POLES + SLOW_POLES;

/// The numbers of the inverse.
#[derive(Clone, Debug)]
pub(crate) struct HeatInverse {
    poles: [SampledLag; POLES],
    /// Heating that a kelvin more after one tick takes.
    per_kelvin: f32,
}

/// Temperatures of the lags of one actuator.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeatState([LagState; POLES]);

impl HeatInverse {
    pub(crate) fn new(heat: &Heat) -> Self {
        let mut lags = heat.fast.iter().chain(&heat.slow).map(SampledLag::new);
        let poles = core::array::from_fn(|_| lags.next().unwrap_or_default());
        Self {
            per_kelvin: 1.0 / poles.iter().map(SampledLag::gain).sum::<f32>(),
            poles,
        }
    }

    /// The heating for which the temperature rise is `target` after the next tick: what power at rest
    /// would make in the end.
    pub(crate) fn heating(&self, state: &HeatState, target: Kelvin) -> Kelvin {
        let lags = self.poles.iter().zip(&state.0);
        let coasting: f32 = lags.map(|(lag, at)| lag.coast(at)).sum();
        Kelvin((target.0 - coasting) * self.per_kelvin)
    }

    /// A tick with the heating that was really there.
    pub(crate) fn advance(&self, state: &mut HeatState, heating: Kelvin) {
        for (lag, at) in self.poles.iter().zip(&mut state.0) {
            lag.advance(at, heating.0);
        }
    }
}

impl HeatState {
    /// The temperature rise now.
    pub(crate) fn rise(&self) -> Kelvin {
        Kelvin(self.0.iter().map(LagState::value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_temperature_is_where_it_must_be_a_tick_later(
            course in proptest::collection::vec(0.0_f32..100.0, 1..100),
        ) {
            let inverse = HeatInverse::new(&parts().heat);
            let mut state = HeatState::default();
            for target in course {
                let heating = inverse.heating(&state, Kelvin(target));
                inverse.advance(&mut state, heating);
                let error = state.rise().0 - target;
                prop_assert!(error.abs() < 2e-4, "{error}");
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
            for heating in limited {
                inverse.advance(&mut state, Kelvin(heating));
            }
            let heating = inverse.heating(&state, Kelvin(target));
            inverse.advance(&mut state, heating);
            prop_assert!((state.rise().0 - target).abs() < 2e-4);
        }
    }

    #[test]
    fn without_poles_heating_is_temperature() {
        let inverse = HeatInverse::new(&Heat::INSTANT);
        let state = HeatState::default();
        assert_eq!(inverse.heating(&state, Kelvin(42.0)), Kelvin(42.0));
    }
}
