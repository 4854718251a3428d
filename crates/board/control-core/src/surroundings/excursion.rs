//! How far an actuator has moved of late, and what a resistance and the stages may be apart by for it.

use super::period::PERIOD;
use crate::design::TICK;
use crate::units::{Kelvin, Second};

/// Time in which what has moved settles beyond the fast poles: plate and frame of virtual mirrors take 0.1 to 0.4 s to be as warm as
/// their beams make them (`closed-loop`, test `surroundings`).
pub const SETTLES: Second = Second(0.3);
/// Part of what an actuator has moved by which a resistance and the stages may be apart meanwhile: on virtual mirrors up to 1.8 %, for a
/// heater sees the heat of plate and frame by other weights than the bend does.
pub const APART: f32 = 0.02;
/// That is one error for all updates of its time and no noise of each: white noise of the same power at low frequencies has 2 T / dt of its
/// variance [Simon 2006, section 7.2].
pub(super) const AS_NOISE: f32 = 2.0 * SETTLES.0 / (TICK.0 * PERIOD as f32);
/// Of a difference, an update takes up so much.
const UPDATE: f32 = TICK.0 * PERIOD as f32 / SETTLES.0;

/// What is left of an actuator's moves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Excursion {
    /// Where it was, in the mean of its last moments (K).
    mean: f32,
    /// How far it was from there at most, falling as that settles (K).
    range: f32,
}

impl Excursion {
    /// An update's time passes with the stages asked for `rise`.
    pub(super) fn pass(&mut self, rise: Kelvin) {
        self.mean += UPDATE * (rise.0 - self.mean);
        self.range -= UPDATE * self.range;
        let away = (rise.0 - self.mean).abs();
        if away > self.range {
            self.range = away;
        }
    }

    /// Variance of what a reading may be off by for it (K^2).
    pub(super) fn variance(&self) -> f32 {
        APART * APART * self.range * self.range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Updates in a second.
    const SECOND: usize = 625;

    fn after(rises: impl IntoIterator<Item = f32>) -> Excursion {
        let mut excursion = Excursion::default();
        rises
            .into_iter()
            .for_each(|rise| excursion.pass(Kelvin(rise)));
        excursion
    }

    #[test]
    fn a_move_is_forgotten_as_heat_settles() {
        let moved = after([50.0]);
        // Two per cent of 50 K is 1 K, and 375 updates are twice 0.3 s; the mean has moved on by an update's part.
        assert!((AS_NOISE - 375.0).abs() < 1e-3);
        assert!((moved.variance() - 1.0).abs() < 0.02, "{moved:?}");
        let rested = after([50.0; SECOND]);
        // e^-3.3 of it after a second.
        let left = (rested.variance() / moved.variance()).sqrt();
        assert!((left / f32::exp(-1.0 / 0.3) - 1.0).abs() < 0.02, "{left}");
    }

    #[test]
    fn what_goes_to_and_fro_has_its_amplitude_at_its_middle_too() {
        let sine = |update: usize| 60.0 + 20.0 * (update as f32 * 0.2).sin();
        let excursion = after((0..8 * SECOND).map(sine));
        // The mean swings by a hundredth of it; what falls between two turns is 8 %.
        assert!((18.0..20.5).contains(&excursion.range), "{excursion:?}");
    }
}
