//! The stage `drive`: volts to PWM codes, with the rounding error carried into the next tick.
//!
//! A code is 1 mV, at the top of the range 75 nm. The codes' mean is the drive asked for, and the
//! mirror, whose fastest time constant is several ticks, sees the mean.

use crate::codes::{PWM_COUNTS_PER_VOLT as COUNTS, PwmCode};
use crate::design::PWM_PERIOD_COUNTS;
use crate::units::Volt;

/// Part of what rounding has left that is kept. A drive of whole counts is none quite in f32, and what it lacks must
/// not add up to a count; a drive in between is off by 0.3 uV at most.
const KEPT: f32 = 0.999;

/// What rounding has left so far of one channel, in counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rounding(f32);

/// The highest code that does not drive more than `bound`.
pub(crate) fn highest_code(bound: Volt) -> u16 {
    // The cast saturates, and half a percent of a count forgives what f32 makes of the bound.
    ((bound.0 * COUNTS + 0.005) as u16).min(PWM_PERIOD_COUNTS)
}

impl Rounding {
    /// The code for `drive`, at least 0 V; 0 V is code 0.
    pub(crate) fn code(&mut self, drive: Volt, highest: u16) -> PwmCode {
        let counts = drive.0 * COUNTS + self.0;
        // The cast saturates, and takes NaN to 0.
        let code = (counts + 0.5) as u32;
        if drive.0 > 0.0 && code <= u32::from(highest) {
            self.0 = (counts - code as f32) * KEPT;
            return PwmCode(code as u16);
        }
        self.0 = 0.0;
        PwmCode(if drive.0 > 0.0 { highest } else { 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_mean_of_the_codes_is_the_drive(drive in 0.001_f32..3.499) {
            let mut rounding = Rounding::default();
            let sum: f64 = (0..10_000).map(|_| f64::from(rounding.code(Volt(drive), 3500).0)).sum();
            let error = sum / 1e4 - f64::from(drive) * 1e3;
            prop_assert!(error.abs() < 1e-3, "{error} counts");
        }

        #[test]
        fn any_bit_pattern_gives_a_code_within_the_bound(bits: u32, again: u32) {
            let mut rounding = Rounding::default();
            for bits in [bits, again, bits] {
                prop_assert!(rounding.code(Volt(f32::from_bits(bits)), 3500).0 <= 3500);
            }
        }
    }

    #[test]
    fn whole_millivolts_stay_whole() {
        for millivolt in 1..=3500 {
            let drive = Volt(f32::from(millivolt) / 1e3);
            let mut rounding = Rounding::default();
            let is_whole = |_| rounding.code(drive, 3500) == PwmCode(millivolt);
            assert!((0..10_000).all(is_whole), "{millivolt} mV");
        }
    }

    #[test]
    fn off_is_off() {
        let mut rounding = Rounding::default();
        rounding.code(Volt(0.0014), 3500);
        assert_eq!(rounding.code(Volt(0.0), 3500), PwmCode(0));
        assert_eq!(highest_code(Volt(3.5)), 3500);
        assert_eq!(highest_code(Volt(99.0)), PWM_PERIOD_COUNTS);
    }
}
