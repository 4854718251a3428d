//! Whether single heaters still tell what they told at calibration.
//!
//! The room and the air are the same for all four actuators, so what one heater tells otherwise than the other three, and goes
//! on telling, is its own: its resistance, its temperature coefficient or its way of losing heat has changed. Its innovations,
//! normalised by their deviation, have a mean then, which a two-sided cumulative sum finds [Page 1954].

use super::period::PERIOD;
use crate::CHANNELS;
use crate::design::TICK;
use crate::units::Kelvin;

/// What a sound heater's curve is off by in its own room (K): up to 0.2 K on the mirrors that this was developed on (`closed-loop`,
/// test `drift`).
pub(super) const OWN: Kelvin = Kelvin(0.2);
/// Deviations that are let pass: what is stated above stays for as long as the room does, and is no noise. Two, so that what is within
/// 95 % of what sound actuators may be off by adds nothing.
const ALLOWANCE: f32 = 2.0;
/// The sum from which on an actuator has drifted: a deviation beyond the allowance for 2.6 s, an update in 64 ticks. A choice: the tests
/// `closed-loop/tests/drift` say that sound mirrors stay below it and that each that ages is told in time.
const TOLD: f32 = 400.0;
/// And until which: half, so that it is not told and taken back by the same noise.
const UNTOLD: f32 = 0.5 * TOLD;
/// Surroundings that jump so often, more than once in ten seconds, are none: a loss of another kind than the calibration's looks like
/// another room at each drive. Eight of them are a choice.
const JUMPS: f32 = 8.0;
const JUMPS_LET_PASS: f32 = TICK.0 * PERIOD as f32 / 10.0;
/// Updates within which jumps are one, 0.1 s: beams follow another room by their own time constants of 5 to 50 ms, and the filter comes after
/// them in several jumps.
const ONE_JUMP: u8 = 64;

/// An update's part of the mean of the last ones: of 0.4 s, within which a drift is not yet told.
const OF_AN_UPDATE: f32 = 1.0 / 64.0;

/// One innovation of one actuator, in kelvins of the surroundings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation {
    pub(super) off: f32,
    /// By the filter's covariance, the reading's noise and what sound actuators are apart by (K^2).
    pub(super) variance: f32,
}

/// The sums of the four.
#[derive(Clone, Debug, Default)]
pub(super) struct Drift {
    above: [f32; CHANNELS],
    below: [f32; CHANNELS],
    /// Whose turn it is.
    turn: usize,
    told: [bool; CHANNELS],
    /// What each is off by from the mean of the four, in the mean of its last updates (K).
    off: [f32; CHANNELS],
    /// The most of that.
    apart: f32,
    /// Jumps of the surroundings, less those that are let pass.
    jumps: f32,
    /// Updates in which another jump is still the last one.
    jumping: u8,
}

impl Drift {
    /// Whether it is this actuator's turn.
    pub(super) fn watches(&self, actuator: usize) -> bool {
        actuator == self.turn
    }

    /// Whether one of them has drifted.
    pub(super) fn is_told(&self) -> bool {
        self.told.contains(&true) || self.jumps > JUMPS
    }

    /// How far one of the four is off from their mean at most, in the mean of its last updates (K): where three have drifted alike, so much of it
    /// was taken for the room.
    pub(super) fn apart(&self) -> f32 {
        self.apart
    }

    /// The surroundings have jumped, as far as the filter can tell.
    pub(super) fn jumped(&mut self) {
        if self.jumping == 0 && self.jumps < 2.0 * JUMPS {
            self.jumps += 1.0;
        }
        self.jumping = ONE_JUMP;
    }

    /// The next one's turn.
    pub(super) fn turn(&mut self) {
        self.turn = (self.turn + 1) % CHANNELS;
        if self.turn == 0 {
            let farther = |most: f32, off: &f32| if off.abs() > most { off.abs() } else { most };
            self.apart = self.off.iter().fold(0.0, farther);
        }
        if self.jumps > 0.0 {
            self.jumps -= JUMPS_LET_PASS;
            self.jumping = self.jumping.saturating_sub(1);
        }
    }

    /// The innovation of the actuator whose turn it is.
    pub(super) fn watch(&mut self, innovation: &Innovation) {
        let Innovation { off, variance } = *innovation;
        let deviations = off / fpu::sqrt(variance + OWN.0 * OWN.0);
        let turn = self.turn % CHANNELS;
        let (above, below) = (&mut self.above[turn], &mut self.below[turn]);
        *above = summed(*above + deviations - ALLOWANCE);
        *below = summed(*below - deviations - ALLOWANCE);
        let mean = self.off[turn] + OF_AN_UPDATE * (off - self.off[turn]);
        self.off[turn] = if mean.is_finite() { mean } else { 0.0 };
        let told = &mut self.told[turn];
        let bound = if *told { UNTOLD } else { TOLD };
        *told = *above > bound || *below > bound;
    }

    /// The largest sum, as a part of what is told.
    pub(super) fn evidence(&self) -> f32 {
        let sums = self.above.iter().chain(&self.below);
        sums.fold(self.jumps / JUMPS, |largest, sum| largest.max(sum / TOLD))
    }
}

/// A sum that neither falls below nothing nor takes forever to come back; NaN becomes 0.
fn summed(sum: f32) -> f32 {
    const MOST: f32 = 2.0 * TOLD;
    if sum > MOST {
        MOST
    } else if sum > 0.0 {
        sum
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// An actuator's updates in ten seconds.
    const TEN_SECONDS: usize = 100_000 / (4 * PERIOD);

    fn innovation(off: f32) -> Innovation {
        Innovation { off, variance: 0.0 }
    }

    /// Ten seconds of innovations, the same for each actuator at every turn; whether it is told then.
    fn ten_seconds(drift: &mut Drift, innovations: [Innovation; CHANNELS]) -> bool {
        for _ in 0..TEN_SECONDS {
            for innovation in &innovations {
                drift.watch(innovation);
                drift.turn();
            }
        }
        drift.is_told()
    }

    #[test]
    fn what_stays_is_told_either_way_and_for_each_actuator_and_taken_back_when_it_ends() {
        for actuator in 0..CHANNELS {
            for sign in [-1.0, 1.0] {
                let mut drift = Drift::default();
                let mut apart = [innovation(0.0); CHANNELS];
                apart[actuator].off = sign * 3.0 * OWN.0;
                assert!(ten_seconds(&mut drift, apart), "{actuator} {sign}");
                assert!(!ten_seconds(&mut drift, [innovation(0.0); CHANNELS]));
            }
        }
    }

    #[test]
    fn what_a_sound_curve_or_its_surroundings_may_be_off_by_is_not_told() {
        let mut drift = Drift::default();
        let own = innovation(1.9 * OWN.0);
        let apart = Innovation {
            off: -1.9,
            variance: 1.0,
        };
        let unknown = Innovation {
            off: 20.0,
            variance: 225.0,
        };
        for _ in 0..100 {
            assert!(!ten_seconds(&mut drift, [own, apart, own, unknown]));
        }
    }

    #[test]
    fn jumps_are_told_that_come_again_and_again_and_none_that_is_followed_in_parts() {
        let of = |apart: usize, together: usize| {
            let mut drift = Drift::default();
            (0..TEN_SECONDS * CHANNELS).any(|update| {
                if update % apart < together {
                    drift.jumped();
                }
                drift.turn();
                drift.is_told()
            })
        };
        // Updates of 1.6 ms: a kelvin of an oven each second, in five parts, and moves of half a second in a vacuum.
        assert!(!of(2000, 20));
        assert!(of(300, 1));
    }

    #[test]
    fn what_passes_is_not_told() {
        let mut drift = Drift::default();
        // A jump of the room until the filter is there: some updates of many deviations, as often as once in ten seconds.
        for _ in 0..100 {
            for _ in 0..10 {
                drift.watch(&innovation(20.0 * OWN.0));
            }
            assert!(!ten_seconds(&mut drift, [innovation(0.0); CHANNELS]));
        }
    }

    proptest! {
        #[test]
        fn any_bit_pattern_leaves_finite_sums(bits in proptest::array::uniform2(any::<u32>())) {
            let mut drift = Drift::default();
            let [off, variance] = bits.map(f32::from_bits);
            drift.watch(&Innovation { off, variance });
            prop_assert!(drift.above.iter().chain(&drift.below).all(|sum| sum.is_finite()));
            prop_assert!(!ten_seconds(&mut drift, [innovation(0.0); CHANNELS]));
        }
    }
}
