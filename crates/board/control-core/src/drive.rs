//! The stage `drive`: volts to PWM codes, by a first-order error-feedback quantiser.
//!
//! A code is 1 mV, at the top of the range 75 nm. The rounding error of a tick is added to the next one's input
//! (a first-order sigma-delta modulator), so that the codes' mean is the drive asked for, and the
//! mirror, whose fastest time constant is several ticks, sees the mean.

use core::hint::cold_path;

use crate::codes::{PWM_COUNTS_PER_VOLT as COUNTS, PwmCode};
use crate::design::{HIGHEST_DRIVE, PWM_PERIOD_COUNTS};
use crate::units::Volt;

/// Bits of a count's fraction: f32 has no more of a drive.
const FRACTION_BITS: u32 = 16;
const WHOLE: i32 = 1 << FRACTION_BITS;
/// The rounding error in a code that is not rounded: half a count, so that whole counts stay whole.
const HALF: i32 = WHOLE / 2;
/// Bits of the fed-back error's leak. A drive of whole counts is none quite in f32, and what it lacks must not add up to a
/// count: f32 is off by at most 2^-13 counts below 4096, which this leak, 2^-10, keeps below 0.13 counts. It takes at most
/// 0.001 x 0.5 counts from a tick's mean: 0.5 uV.
const LEAK_BITS: u32 = 10;

/// The quantiser of one channel; its state is the last rounding error and half a count, in fractions of a count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantiser(i32);

/// The highest code that does not drive more than `bound`, nor more than the board's design allows.
pub(crate) fn highest_code(bound: Volt) -> u16 {
    // The cast saturates, and half a percent of a count forgives what f32 makes of the bound.
    let code = |bound: Volt| ((bound.0 * COUNTS + 0.005) as u16).min(PWM_PERIOD_COUNTS);
    code(bound).min(code(HIGHEST_DRIVE))
}

impl Default for Quantiser {
    fn default() -> Self {
        Self(HALF)
    }
}

impl Quantiser {
    /// The code for `drive`, at least 0 V; 0 V is code 0.
    #[inline(always)]
    pub(crate) fn code(&mut self, drive: Volt, highest: u16) -> PwmCode {
        // The cast saturates, and takes NaN to 0.
        let counts = ((drive.0 * (COUNTS * WHOLE as f32)) as i32).saturating_add(self.0);
        let code = counts >> FRACTION_BITS;
        if code as u32 > u32::from(highest) {
            cold_path();
            self.0 = HALF;
            return PwmCode(if code < 0 { 0 } else { highest });
        }
        let error = counts & (WHOLE - 1);
        self.0 = error + (HALF >> LEAK_BITS) - (error >> LEAK_BITS);
        PwmCode(code as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_mean_of_the_codes_is_the_drive(drive in 0.001_f32..3.499) {
            let mut quantiser = Quantiser::default();
            let sum: f64 = (0..10_000).map(|_| f64::from(quantiser.code(Volt(drive), 3500).0)).sum();
            let error = sum / 1e4 - f64::from(drive) * 1e3;
            // A count that is carried over is 1e-4 of the mean of 10 000; rounding is 2.4e-4 counts at 3500.
            prop_assert!(error.abs() < 1e-3, "{error} counts");
        }

        #[test]
        fn any_bit_pattern_gives_a_code_within_the_bound(bits: u32, again: u32) {
            let mut quantiser = Quantiser::default();
            for bits in [bits, again, bits] {
                prop_assert!(quantiser.code(Volt(f32::from_bits(bits)), 3500).0 <= 3500);
            }
        }
    }

    #[test]
    fn whole_millivolts_stay_whole() {
        for millivolt in 1..=3500 {
            let drive = Volt(f32::from(millivolt) / 1e3);
            let mut quantiser = Quantiser::default();
            let is_whole = |_| quantiser.code(drive, 3500) == PwmCode(millivolt);
            assert!((0..10_000).all(is_whole), "{millivolt} mV");
        }
    }

    #[test]
    fn off_is_off() {
        let mut quantiser = Quantiser::default();
        quantiser.code(Volt(0.0014), 3500);
        assert_eq!(quantiser.code(Volt(0.0), 3500), PwmCode(0));
        assert_eq!(highest_code(Volt(3.5)), 3500);
        assert_eq!(highest_code(Volt(99.0)), 3500);
    }
}
