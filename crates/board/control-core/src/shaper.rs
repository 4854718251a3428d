//! A way that others give, so that the plate does not ring where it has corners.
//!
//! What is asked for is a mean of the way now and the way half a period of the resonance ago, weighted so that the second answer of the
//! plate ends the first one's ringing (zero-vibration shaper; Singer and Seering, J. Dyn. Sys., Meas., Control 112 (1990) 76). Half a
//! period lies between two ticks: both have their part, for which nothing is left exactly.

use core::f32::consts::PI;

use crate::CHANNELS;
use crate::calibration::Resonance;
use crate::design::TICK;

/// Ticks that are remembered: half a period of 165 Hz is 30.3, and the place between two ticks takes one more.
const REMEMBERED: usize = 32;

/// A zero-vibration shaper of all four actuators.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shaper {
    /// How many ticks ago the second part is; the third is a tick older.
    ago: usize,
    /// Weights of these two; 0 where nothing rings.
    second: f32,
    third: f32,
    past: [[f32; CHANNELS]; REMEMBERED],
    /// Where the latest is.
    latest: usize,
    /// Whether the past is one.
    is_following: bool,
}

impl Shaper {
    pub(crate) fn new(resonance: &Resonance) -> Self {
        // What is damped critically does not ring.
        if !resonance.is_known() || resonance.quality <= 0.5 {
            return Self::default();
        }
        let damping = 0.5 / resonance.quality;
        let radians = 2.0 * PI * resonance.frequency.0 * TICK.0;
        let damped = radians * libm::sqrtf(1.0 - damping * damping);
        let ago = PI / damped;
        if ago >= (REMEMBERED - 1) as f32 {
            return Self::default();
        }
        // What was asked so many ticks ago has rung on since: by how much it weighs more now, and in which phase it is.
        let since = |ticks: f32| {
            let grown = libm::expf(damping * radians * ticks);
            let phase = damped * ticks;
            (grown * libm::cosf(phase), grown * libm::sinf(phase))
        };
        let ago = libm::floorf(ago);
        let ((second, out_of_second), (third, out_of_third)) = (since(ago), since(ago + 1.0));
        // What is out of phase cancels between these two, and what is in phase with the first part against it.
        let weights = (-out_of_third, out_of_second);
        let first = -(weights.0 * second + weights.1 * third);
        let sum = first + weights.0 + weights.1;
        Self {
            ago: ago as usize,
            second: weights.0 / sum,
            third: weights.1 / sum,
            ..Self::default()
        }
    }

    /// Ticks by which the way is late.
    pub(crate) fn delay_ticks(&self) -> f32 {
        self.ago as f32 * (self.second + self.third) + self.third
    }

    /// The next of the way, which began at `before`.
    pub(crate) fn shape(
        &mut self,
        before: &[f32; CHANNELS],
        next: &[f32; CHANNELS],
    ) -> [f32; CHANNELS] {
        if self.ago == 0 {
            return *next;
        }
        if !self.is_following {
            self.past = [*before; REMEMBERED];
            self.is_following = true;
        }
        self.latest = (self.latest + 1) % REMEMBERED;
        self.past[self.latest] = *next;
        let at = |ago: usize| &self.past[(self.latest + REMEMBERED - ago) % REMEMBERED];
        let (second, third) = (at(self.ago), at(self.ago + 1));
        core::array::from_fn(|i| {
            let now = next[i];
            now + self.second * (second[i] - now) + self.third * (third[i] - now)
        })
    }

    /// The way ends.
    pub(crate) fn forget(&mut self) {
        self.is_following = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Hertz;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn resonance(hz: f32, quality: f32) -> Resonance {
        Resonance {
            frequency: Hertz(hz),
            quality,
        }
    }

    #[test]
    fn what_does_not_ring_is_passed_on() {
        for none in [Resonance::UNKNOWN, resonance(500.0, 0.5)] {
            let mut shaper = Shaper::new(&none);
            assert_eq!(shaper.delay_ticks(), 0.0);
            assert_eq!(
                shaper.shape(&[0.0; CHANNELS], &[7.0; CHANNELS]),
                [7.0; CHANNELS]
            );
        }
    }

    #[test]
    fn a_jump_is_taken_in_two_and_forgotten_with_the_way() {
        let mut shaper = Shaper::new(&resonance(500.0, 1e4));
        let (from, to) = ([10.0; CHANNELS], [30.0; CHANNELS]);
        for tick in 0..30 {
            let now = shaper.shape(&from, &to)[2];
            let expected = if tick < 10 { 20.0 } else { 30.0 };
            // A quality of 10 000 is not infinite, and a tick at the change is in between.
            assert!(
                tick == 10 || (now - expected).abs() < 0.01,
                "{now} in tick {tick}"
            );
        }
        shaper.forget();
        assert!((shaper.shape(&[50.0; CHANNELS], &to)[0] - 40.0).abs() < 0.01);
    }

    proptest! {
        /// A plate on a spring rings after a corner of its way by three thousandths of what it would unshaped: f32 knows ways of a hundred
        /// ticks to 1e-5, and a plate that is damped has rung down to a hundredth meanwhile.
        #[test]
        fn a_corner_leaves_no_ringing(hz in 165.0_f32..4900.0, quality in 1.0_f32..50.0) {
            let mut shaper = Shaper::new(&resonance(hz, quality));
            let ticks = 100 + 2 * REMEMBERED;
            let way = |tick: usize| if tick < 100 { 0.0 } else { (tick - 100) as f32 };
            let shaped: Vec<f64> = (0..ticks)
                .map(|tick| shaper.shape(&[0.0; CHANNELS], &[way(tick); CHANNELS])[0].into())
                .collect();
            let unshaped: Vec<f64> = (0..ticks).map(|tick| way(tick).into()).collect();
            let (left, whole) = (ringing(&shaped, hz, quality), ringing(&unshaped, hz, quality));
            prop_assert!(left < 3e-3 * whole, "{left} of {whole}");
        }

        #[test]
        fn a_slope_comes_late_by_what_is_said(hz in 165.0_f32..4900.0, quality in 1.0_f32..50.0) {
            let mut shaper = Shaper::new(&resonance(hz, quality));
            let mut last = 0.0;
            for tick in 0..100 {
                last = shaper.shape(&[0.0; CHANNELS], &[tick as f32; CHANNELS])[0];
            }
            prop_assert!((99.0 - last - shaper.delay_ticks()).abs() < 1e-4);
        }
    }

    /// Amplitude of what a corner at tick 100 leaves ringing, by the sum of what each bend of the way adds.
    fn ringing(way: &[f64], hz: f32, quality: f32) -> f64 {
        let damping = 0.5 / f64::from(quality);
        let omega = 2.0 * std::f64::consts::PI * f64::from(hz) * f64::from(TICK.0);
        let damped = omega * (1.0 - damping * damping).sqrt();
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (tick, three) in way.windows(3).enumerate() {
            let bend = three[2] - 2.0 * three[1] + three[0];
            let since = tick as f64 - 99.0;
            let grown = (damping * omega * since).exp() * f64::from(u8::from(bend.abs() > 1e-3));
            sine += bend * grown * (damped * since).sin();
            cosine += bend * grown * (damped * since).cos();
        }
        sine.hypot(cosine)
    }
}
