//! The codes of the board's converters, and what one step of each is worth.
//!
//! All of it follows from the design parameters. What a board's current sense is off by is in [`crate::current`].

use crate::design::{
    ADC_CODES, DRIVE_FULL_SCALE, LOGIC_SUPPLY, PWM_PERIOD_COUNTS, SENSE_GAIN, SENSE_PEDESTAL,
    SENSOR_DIVIDER, SENSOR_RANGE_V, SENSOR_UM_PER_VOLT, SENSOR_ZERO, SHUNT, SUPPLY_DIVIDER,
};
use crate::units::{Ampere, Micrometre, Volt};

/// PWM counts per volt at the actuator: 4250 counts are 4.25 V, so one count is 1 mV.
pub const PWM_COUNTS_PER_VOLT: f32 = PWM_PERIOD_COUNTS as f32 / DRIVE_FULL_SCALE.0;

/// Current per code of the sense's converter: 3.3 V / 65536 is what a code is worth at its input, and
/// 264 V/A is what shunt and amplifier make of a current; 0.19 uA.
pub const AMPERE_PER_ADC_CODE: f32 = LOGIC_SUPPLY.0 / ADC_CODES / (SHUNT.0 * SENSE_GAIN);

/// The code at no current (a mean; it is no whole number).
pub const PEDESTAL_CODES: f32 = SENSE_PEDESTAL.0 / LOGIC_SUPPLY.0 * ADC_CODES;

/// Voltage of the output stages' supply per code.
pub const VOLT_PER_SUPPLY_CODE: f32 = LOGIC_SUPPLY.0 / SUPPLY_DIVIDER / ADC_CODES;

/// Voltage of the position sensor per code: 0.17 mV, 3.4 nm.
pub const VOLT_PER_SENSOR_CODE: f32 = LOGIC_SUPPLY.0 / SENSOR_DIVIDER / ADC_CODES;

/// Compare value of one PWM channel, 0 to [`PWM_PERIOD_COUNTS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PwmCode(pub u16);

/// Reading of one current-sense ADC channel, all 16 bits used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AdcCode(pub u16);

/// Reading of the output stages' supply, all 16 bits used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SupplyCode(pub u16);

/// Reading of the position sensor's input, all 16 bits used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorCode(pub u16);

impl SensorCode {
    /// The position that the sensor tells; `None` where it tells none.
    pub fn position(self) -> Option<Micrometre> {
        let volt = f32::from(self.0) * VOLT_PER_SENSOR_CODE;
        let is_reading = SENSOR_RANGE_V.contains(&volt);
        is_reading.then_some(Micrometre((volt - SENSOR_ZERO.0) * SENSOR_UM_PER_VOLT))
    }
}

impl SupplyCode {
    /// The code nearest below a supply of so many millivolts; full scale is 6600.
    pub const fn from_millivolt(millivolt: u32) -> Self {
        let code = millivolt * 65536 / 6600;
        Self(if code > u16::MAX as u32 {
            u16::MAX
        } else {
            code as u16
        })
    }

    /// The voltage that this code stands for.
    pub fn voltage(self) -> Volt {
        Volt(f32::from(self.0) * VOLT_PER_SUPPLY_CODE)
    }
}

impl PwmCode {
    /// The code nearest to `drive`. Below zero and NaN give 0, above full scale gives full scale.
    pub fn nearest(drive: Volt) -> Self {
        // A float to integer cast saturates, and takes NaN to 0.
        let counts = (drive.0 * PWM_COUNTS_PER_VOLT + 0.5) as u16;
        Self(counts.min(PWM_PERIOD_COUNTS))
    }

    /// The actuator voltage that this code makes.
    pub fn drive(self) -> Volt {
        Volt(f32::from(self.0) * (1.0 / PWM_COUNTS_PER_VOLT))
    }
}

impl AdcCode {
    /// What a board as designed reads of a current. Below the range and NaN give 0, above it the top.
    pub fn nearest(current: Ampere) -> Self {
        // A float to integer cast saturates, and takes NaN to 0.
        Self((current.0 / AMPERE_PER_ADC_CODE + PEDESTAL_CODES + 0.5) as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_count_is_a_millivolt() {
        assert_eq!(PwmCode::nearest(Volt(1.9)), PwmCode(1900));
        assert!((PwmCode(1900).drive().0 - 1.9).abs() < 1e-6);
    }

    #[test]
    fn drives_beyond_the_scale_saturate() {
        assert_eq!(PwmCode::nearest(Volt(-1.0)), PwmCode(0));
        assert_eq!(PwmCode::nearest(Volt(f32::NAN)), PwmCode(0));
        assert_eq!(
            PwmCode::nearest(Volt(f32::INFINITY)),
            PwmCode(PWM_PERIOD_COUNTS)
        );
    }

    #[test]
    fn a_supply_code_is_its_voltage() {
        for millivolt in [0, 4_500, 5_000, 5_500, 6_599] {
            let volt = SupplyCode::from_millivolt(millivolt).voltage().0;
            // A step of the converter is 0.1007 mV; the rest is rounding.
            assert!((volt - millivolt as f32 * 1e-3).abs() < 1.1e-4, "{volt} V");
        }
    }

    #[test]
    fn a_sensor_has_a_live_zero_and_reads_nothing_outside_its_range() {
        // 1 V and 8 V, by three tenths of 3.3 V in 16 bits.
        for (code, um) in [(5_957.8, 0.0), (47_662.5, 140.0)] {
            let z = SensorCode(code as u16).position().expect("a reading");
            assert!((z.0 - um).abs() < 4e-3, "{z:?}");
        }
        for code in [0, 2_900, 62_700, 65_520] {
            assert_eq!(SensorCode(code).position(), None, "{code}");
        }
    }

    proptest! {
        #[test]
        fn every_code_returns_to_itself(code in 0..=PWM_PERIOD_COUNTS) {
            prop_assert_eq!(PwmCode::nearest(PwmCode(code).drive()), PwmCode(code));
        }

        #[test]
        fn any_bit_pattern_gives_a_valid_code(bits: u32) {
            prop_assert!(PwmCode::nearest(Volt(f32::from_bits(bits))).0 <= PWM_PERIOD_COUNTS);
        }
    }
}
