//! A way that others give, so that the plate does not ring where it has corners.
//!
//! What is asked for is a mean of the way now and the way half a period of the resonance ago, weighted so that the second answer of the
//! plate ends the first one's ringing (zero-vibration shaper; Singer and Seering, J. Dyn. Sys., Meas., Control 112 (1990) 76). Half a
//! period lies between two ticks: both have their part, for which nothing is left exactly.

use core::f32::consts::PI;

use crate::CHANNELS;
use crate::calibration::Resonance;
use crate::design::TICK;

/// Ticks that are remembered: half a period of 80 Hz at Q = 3 is 63.4, and the place between two ticks takes one more. One that is longer, as at
/// Q = 2, is not shaped: it hardly rings.
const REMEMBERED: usize = 64;

/// A zero-vibration shaper of all four actuators.
// What every tick reads comes first, as in the controller.
#[derive(Clone, Debug)]
#[repr(C)]
pub(crate) struct Shaper {
    /// How many ticks ago the second part is; the third is a tick older.
    ago: usize,
    /// Weights of the three.
    first: f32,
    second: f32,
    third: f32,
    /// Where the oldest is that is needed; the next takes its place. Beyond the end: nothing is remembered.
    oldest: usize,
    past: [[f32; CHANNELS]; REMEMBERED],
}

impl Shaper {
    /// Shapes nothing.
    const NONE: Self = Self {
        ago: 0,
        first: 1.0,
        second: 0.0,
        third: 0.0,
        oldest: REMEMBERED,
        past: [[0.0; CHANNELS]; REMEMBERED],
    };

    pub(crate) fn new(resonance: &Resonance) -> Self {
        // What is damped critically does not ring.
        if !resonance.is_known() || resonance.quality <= 0.5 {
            return Self::NONE;
        }
        let damping = 0.5 / resonance.quality;
        let radians = 2.0 * PI * resonance.frequency.0 * TICK.0;
        let damped = radians * fpu::sqrt(1.0 - damping * damping);
        let ago = PI / damped;
        if ago >= REMEMBERED as f32 {
            return Self::NONE;
        }
        let ago = ago as usize;
        // What was asked a tick ago has rung on since: by so much it weighs more now, turned by so much in its phase.
        let tick = Complex(damping * radians, damped).exp();
        let since = (0..ago).fold(Complex(1.0, 0.0), |since, _| since.times(tick));
        let (Complex(second, out_of_second), Complex(third, out_of_third)) =
            (since, since.times(tick));
        // What is out of phase cancels between these two, and what is in phase with the first part against it.
        let weights = (-out_of_third, out_of_second);
        let first = -(weights.0 * second + weights.1 * third);
        let sum = first + weights.0 + weights.1;
        Self {
            ago,
            first: first / sum,
            second: weights.0 / sum,
            third: weights.1 / sum,
            ..Self::NONE
        }
    }

    /// Ticks by which the way is late.
    pub(crate) fn delay_ticks(&self) -> f32 {
        self.ago as f32 * (self.second + self.third) + self.third
    }

    /// Where the oldest is that is needed of a way that has begun and not ended.
    #[inline(always)]
    pub(crate) fn oldest(&self) -> Option<usize> {
        (self.oldest < REMEMBERED).then_some(self.oldest)
    }

    /// The way so far ends at `now`; `next` of it, shaped, takes its place, and that of the `oldest`.
    #[inline(always)]
    pub(crate) fn shape(
        &mut self,
        oldest: usize,
        next: &[f32; CHANNELS],
        now: &mut [f32; CHANNELS],
    ) {
        let oldest = oldest % REMEMBERED;
        let after = if oldest < self.ago { oldest + 1 } else { 0 };
        let (second, third) = (&self.past[after % REMEMBERED], &self.past[oldest]);
        for (i, now) in now.iter_mut().enumerate() {
            *now = self.first * next[i] + self.second * second[i] + self.third * third[i];
        }
        self.past[oldest] = *next;
        self.oldest = after;
    }

    /// A way begins, where all was at rest; returns where its oldest is.
    #[cold]
    #[inline(never)]
    pub(crate) fn begin(&mut self, at: &[f32; CHANNELS]) -> usize {
        self.past = [*at; REMEMBERED];
        0
    }

    /// The way ends.
    pub(crate) fn forget(&mut self) {
        self.oldest = REMEMBERED;
    }
}

/// A complex number: its real and its imaginary part.
#[derive(Clone, Copy, Debug)]
struct Complex(f32, f32);

impl Complex {
    fn times(self, other: Self) -> Self {
        Self(
            self.0 * other.0 - self.1 * other.1,
            self.0 * other.1 + self.1 * other.0,
        )
    }

    /// Of one no larger than 2 pi: the series of a 32nd of it, whose remainder is 3e-6 there, squared five times.
    fn exp(self) -> Self {
        let part = Self(self.0 / 32.0, self.1 / 32.0);
        let series = [4.0, 3.0, 2.0, 1.0].into_iter();
        let series = series.fold(Self(1.0, 0.0), |sum, order: f32| {
            let term = sum.times(part);
            Self(1.0 + term.0 / order, term.1 / order)
        });
        (0..5).fold(series, |root, _| root.times(root))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Hertz;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// What is asked for of one actuator.
    fn shaped(shaper: &mut Shaper, before: f32, next: f32) -> f32 {
        let mut now = [before; CHANNELS];
        let oldest = shaper.oldest().unwrap_or_else(|| shaper.begin(&now));
        shaper.shape(oldest, &[next; CHANNELS], &mut now);
        now[2]
    }

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
            assert_eq!(shaped(&mut shaper, 0.0, 7.0), 7.0);
        }
    }

    #[test]
    fn a_jump_is_taken_in_two_and_forgotten_with_the_way() {
        let mut shaper = Shaper::new(&resonance(500.0, 1e4));
        for tick in 0..30 {
            let now = shaped(&mut shaper, 10.0, 30.0);
            let expected = if tick < 10 { 20.0 } else { 30.0 };
            // A quality of 10 000 is not infinite.
            assert!((now - expected).abs() < 0.01, "{now} in tick {tick}");
        }
        shaper.forget();
        assert!((shaped(&mut shaper, 50.0, 30.0) - 40.0).abs() < 0.01);
    }

    proptest! {
        /// A plate on a spring rings after a corner of its way by three thousandths of what it would unshaped: f32 knows ways of a hundred
        /// ticks to 1e-5, and a plate that is damped has rung down to a hundredth meanwhile.
        #[test]
        fn a_corner_leaves_no_ringing(hz in 80.0_f32..4900.0, quality in 1.0_f32..50.0) {
            let mut shaper = Shaper::new(&resonance(hz, quality));
            prop_assume!(shaper.ago > 0);
            let ticks = 100 + 2 * REMEMBERED;
            let way = |tick: usize| if tick < 100 { 0.0 } else { (tick - 100) as f32 };
            let shaped: Vec<f64> = (0..ticks)
                .map(|tick| shaped(&mut shaper, 0.0, way(tick)).into())
                .collect();
            let unshaped: Vec<f64> = (0..ticks).map(|tick| way(tick).into()).collect();
            let (left, whole) = (ringing(&shaped, hz, quality), ringing(&unshaped, hz, quality));
            prop_assert!(left < 3e-3 * whole, "{left} of {whole}");
        }

        #[test]
        fn a_slope_comes_late_by_what_is_said(hz in 80.0_f32..4900.0, quality in 1.0_f32..50.0) {
            let mut shaper = Shaper::new(&resonance(hz, quality));
            let mut last = 0.0;
            for tick in 0..100 {
                last = shaped(&mut shaper, 0.0, tick as f32);
            }
            prop_assert!((99.0 - last - shaper.delay_ticks()).abs() < 1e-4);
        }
    }

    /// Bends of a way that are smaller are what f32 makes of it: four half steps of its last digit, 1.5e-5 at a hundred ticks and more.
    const ROUNDING: f64 = 1e-4;

    /// Amplitude of what a corner at tick 100 leaves ringing, by the sum of what each bend of the way adds.
    fn ringing(way: &[f64], hz: f32, quality: f32) -> f64 {
        let damping = 0.5 / f64::from(quality);
        let omega = 2.0 * std::f64::consts::PI * f64::from(hz) * f64::from(TICK.0);
        let damped = omega * (1.0 - damping * damping).sqrt();
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (tick, three) in way.windows(3).enumerate() {
            let bend = three[2] - 2.0 * three[1] + three[0];
            let since = tick as f64 - 99.0;
            let grown =
                (damping * omega * since).exp() * f64::from(u8::from(bend.abs() > ROUNDING));
            sine += bend * grown * (damped * since).sin();
            cosine += bend * grown * (damped * since).cos();
        }
        sine.hypot(cosine)
    }
}
