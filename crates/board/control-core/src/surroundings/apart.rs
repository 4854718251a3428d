//! What one actuator's resistance tells beyond what the room and the air, as all four tell them, make of it.
//!
//! One room is around all four and one air takes their heat, but of neither do they take the same part: a frame warms one more than the
//! other, and a draught takes more of one's heat. That part is a Gauss-Markov process [Brown and Hwang 2012] of a standard deviation in
//! proportion to what the surroundings make of the actuator, so that nothing is taken for it in the room of the calibration, and a
//! Kalman filter of one state follows it.

use super::curves::CURVES_VARIANCE;
use super::period::PERIOD;
use crate::design::TICK;
use crate::units::Second;

/// Part of the room's rise, of what a changed loss takes of an actuator, and of what it takes of one that is hotter than the others more than of
/// these, by which sound actuators of one mirror are apart (standard deviations): as much as on the paper's virtual mirror, and more than on
/// three others (`closed-loop`, test `pose`). On that one a draught tells the actuators apart by up to the whole of the last.
pub(super) const OF_ROOM: f32 = 0.03;
pub(super) const OF_LOSS: f32 = 0.05;
const OF_DIFFERENCE: f32 = 0.5;
/// For so long an actuator stays apart by the same: a pose, for the heat of its neighbours is part of it. A choice.
const STAYS: Second = Second(1.0);
/// Part of that which a period takes up.
const FADES: f32 = TICK.0 * PERIOD as f32 / STAYS.0;

/// Variance of what an actuator at a heating is apart by, where all four are at another in the mean (K^2).
pub(super) fn usual(room: f32, loss: f32, (heating, mean): (f32, f32)) -> f32 {
    let of_room = OF_ROOM * room;
    let (taken, more) = (OF_LOSS * heating, OF_DIFFERENCE * (heating - mean));
    of_room * of_room + loss * loss * (taken * taken + more * more)
}

/// By how much one actuator is apart, in kelvins of the surroundings.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Apart {
    mean: f32,
    variance: f32,
    /// What of it is not the curve's own error (K), and the variance of what that leaves unknown (K^2).
    pub(super) counted: f32,
    pub(super) unknown: f32,
}

impl Apart {
    /// A reading is so far from what the room and the air make of it, which may be off by this variance.
    pub(super) fn read(&mut self, apart: f32, variance: f32) {
        let gain = self.variance / (self.variance + variance);
        // Not so for NaN, which would stay.
        if gain > 0.0 && apart.is_finite() {
            self.mean += gain * (apart - self.mean);
            self.variance -= gain * self.variance;
        }
    }

    /// A period passes, in which it is usually apart by so much (variance).
    pub(super) fn pass(&mut self, usual: f32) {
        self.mean -= FADES * self.mean;
        self.variance += FADES * (usual - self.variance);
        let part = usual / (usual + CURVES_VARIANCE);
        let rest = 1.0 - part;
        self.counted = part * self.mean;
        // What is followed of it, and what is not.
        let followed = usual - self.variance;
        let followed = if followed > 0.0 { followed } else { 0.0 };
        self.unknown = rest * rest * followed + self.variance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Periods in a second.
    const SECOND: usize = (1.0 / FADES) as usize;
    /// Variance of a reading at 1 V, 0.1 K (`docs/theory/surroundings.md`).
    const NOISE: f32 = 0.01;

    /// A second in which its resistance tells so much, with what is usual.
    fn a_second(apart: &mut Apart, told: f32, usual: f32) {
        for _ in 0..SECOND {
            apart.read(told, NOISE);
            apart.pass(usual);
        }
    }

    #[test]
    fn in_the_room_of_the_calibration_nothing_is_counted() {
        let mut apart = Apart::default();
        // What curves are off by at most.
        a_second(&mut apart, 0.25, usual(0.0, 0.0, (60.0, 50.0)));
        assert_eq!((apart.counted, apart.unknown), (0.0, 0.0));
    }

    #[test]
    fn elsewhere_it_is_followed_as_far_as_it_is_not_the_curves_own() {
        for (usual, told) in [
            (usual(10.0, 0.0, (60.0, 60.0)), 0.4),
            (usual(0.0, 0.1, (90.0, 60.0)), -2.0),
        ] {
            let mut apart = Apart::default();
            a_second(&mut apart, told, usual);
            let part = usual / (usual + CURVES_VARIANCE);
            // A hundredth fades while it is followed.
            assert!(
                (apart.counted - part * told).abs() < 0.02 * told.abs(),
                "{apart:?}"
            );
            // What stays unknown is the curve's share, and some of the noise.
            let left = usual * CURVES_VARIANCE / (usual + CURVES_VARIANCE);
            assert!(apart.unknown < left + NOISE, "{apart:?}, {left}");
            // Where nothing is read any more it fades, and may be anything usual.
            (0..5 * SECOND).for_each(|_| apart.pass(usual));
            assert!(apart.counted.abs() < 0.01 * told.abs(), "{apart:?}");
            assert!(apart.unknown > 0.9 * usual, "{apart:?} of {usual}");
        }
    }

    proptest! {
        #[test]
        fn what_was_told_does_not_keep_it_from_what_is_told_next(told: u32, variance: u32) {
            let mut apart = Apart::default();
            let usual = usual(10.0, 0.1, (60.0, 50.0));
            apart.pass(usual);
            apart.read(f32::from_bits(told).clamp(-126.0, 126.0), f32::from_bits(variance).abs());
            (0..5).for_each(|_| a_second(&mut apart, 1.0, usual));
            prop_assert!((apart.counted - usual / (usual + CURVES_VARIANCE)).abs() < 0.03, "{:?}", apart);
        }
    }
}
