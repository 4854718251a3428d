//! The analogue half of the driver board, in its own physical terms: what a compare value does to an
//! actuator, and what a current becomes on the way into the converter.
//!
//! It shares no constant with the firmware, so that a wrong scale there shows here: these are the numbers of
//! `docs/board.md` written down a second time, and not those of `control_core::design`.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ADC_REFERENCE_V: f64 = 3.3;
const ADC_TOP_12_BIT: f64 = 4095.0;
const OVERSAMPLING: usize = 16;
const PWM_SUPPLY_V: f64 = 3.3;
const PWM_PERIOD_COUNTS: f64 = 4250.0;
const OUTPUT_GAIN: f64 = 4.25 / 3.3;
const SUPPLY_DIVIDER: f64 = 0.5;
const SENSOR_DIVIDER: f64 = 0.3;
/// A position sensor's voltage at zero, and for each micrometre.
const SENSOR_ZERO_V: f64 = 1.0;
const SENSOR_V_PER_UM: f64 = 0.05;
const SHUNT_OHM: f64 = 10.0;
const SENSE_GAIN: f64 = 26.4;
/// What a divider of 100 to 1 makes of the reference, at the amplifier's reference pin.
const PEDESTAL_V: f64 = 3.3 / 101.0;

/// Noise of one 12-bit conversion, in its steps. It is what makes oversampling resolve more.
const NOISE_STEPS: f64 = 1.2;
/// Standard deviation of a channel's gain: shunt and amplifier.
const GAIN_TOLERANCE: f64 = 3e-3;
/// Standard deviation of the amplifier's offset at its input.
const OFFSET_V: f64 = 40e-6;

/// What the comparators at the outputs bear (V).
const COMPARATOR_V: f64 = 3.7;
/// The load switch brings the stages' supply up to 95 % in 0.75 ms, and discharges their 10 uF by 25 ohm (s).
const RAIL_S: f64 = 0.25e-3;

/// The supply of the output stages, behind their load switch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rail(f64);

impl Rail {
    /// Lets so many seconds pass with `source_v` in front of the switch.
    pub fn advance(&mut self, is_on: bool, source_v: f64, seconds: f64) {
        let target_v = if is_on { source_v } else { 0.0 };
        self.0 = target_v + (self.0 - target_v) * (-seconds / RAIL_S).exp();
    }

    /// What stages give that would give this much: no more than they get.
    pub fn limit(self, stage_v: [f64; 4]) -> [f64; 4] {
        stage_v.map(|volts| volts.min(self.0))
    }
}

/// Whether a comparator finds too much at one of the actuators.
pub fn is_over_voltage(heated_v: [f64; 4]) -> bool {
    heated_v.iter().any(|volts| *volts > COMPARATOR_V)
}

/// The comparators at the outputs, and the latch of the timer's break input that they work on: once they find too much the
/// outputs are disabled, until the board has disabled and enabled them itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Comparators {
    has_broken: bool,
    are_enabled: bool,
}

impl Comparators {
    /// The board enables its outputs in this tick, or does not.
    pub(crate) fn enable(&mut self, are_enabled: bool) {
        self.has_broken &= !are_enabled || self.are_enabled;
        self.are_enabled = are_enabled;
    }

    /// Whether the stages follow their codes.
    pub(crate) fn let_drive(self) -> bool {
        self.are_enabled && !self.has_broken
    }

    /// Looks at the actuators; whether that has disabled the outputs.
    pub(crate) fn disable(&mut self, heated_v: [f64; 4]) -> bool {
        let is_new = !self.has_broken && is_over_voltage(heated_v);
        self.has_broken |= is_new;
        is_new
    }

    /// Whether they have disabled the outputs since the board enabled them.
    pub(crate) fn have_broken(self) -> bool {
        self.has_broken
    }
}

/// Four output stages and four current senses.
#[derive(Clone, Debug)]
pub struct Electronics {
    sense_gain: [f64; 4],
    offset_v: [f64; 4],
    rng: ChaCha8Rng,
}

impl Electronics {
    /// A board off the line: the seed draws its tolerances and its noise.
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let sense_gain = std::array::from_fn(|_| 1.0 + GAIN_TOLERANCE * normal(&mut rng));
        let offset_v = std::array::from_fn(|_| OFFSET_V * normal(&mut rng));
        Self {
            sense_gain,
            offset_v,
            rng,
        }
    }

    /// Voltage that a compare value puts on an actuator, behind filter and buffer. The shunt lies
    /// within the buffer's feedback, so its drop is compensated.
    pub fn drive_v(&self, compare: u16) -> f64 {
        self.stage_v((f64::from(compare) / PWM_PERIOD_COUNTS).min(1.0))
    }

    /// Voltage that a stage puts on its actuator, where its filter gives this part of the logic's supply.
    #[inline]
    pub fn stage_v(&self, part: f64) -> f64 {
        part * PWM_SUPPLY_V * OUTPUT_GAIN
    }

    /// Voltage at the converter's pin for a channel's current.
    pub fn sense_v(&self, channel: usize, current_a: f64) -> f64 {
        let shunt_v = current_a * SHUNT_OHM + self.offset_v[channel];
        shunt_v * SENSE_GAIN * self.sense_gain[channel] + PEDESTAL_V
    }

    /// Voltage at the converter's pin for the supply of the output stages.
    pub fn supply_v(&self, supply_v: f64) -> f64 {
        supply_v * SUPPLY_DIVIDER
    }

    /// Voltage at the converter's pin for a position sensor that reads this (um); pulled down where nothing is connected.
    pub fn sensor_v(&self, z_um: Option<f64>) -> f64 {
        z_um.map_or(0.0, |um| {
            SENSOR_DIVIDER * (SENSOR_ZERO_V + um * SENSOR_V_PER_UM)
        })
    }

    /// What the converter reads of a channel's current.
    pub fn sense_code(&mut self, channel: usize, current_a: f64) -> u16 {
        self.convert(self.sense_v(channel, current_a))
    }

    /// What the converter reads of the output stages' supply.
    pub fn supply_code(&mut self, supply_v: f64) -> u16 {
        self.convert(self.supply_v(supply_v))
    }

    /// One conversion of 12 bits.
    pub fn convert_once(&mut self, pin_v: f64) -> u16 {
        let steps = pin_v / ADC_REFERENCE_V * (ADC_TOP_12_BIT + 1.0);
        let noise = NOISE_STEPS * normal(&mut self.rng);
        (steps + noise).round().clamp(0.0, ADC_TOP_12_BIT) as u16
    }

    /// The sum of 16 conversions.
    fn convert(&mut self, pin_v: f64) -> u16 {
        (0..OVERSAMPLING).map(|_| self.convert_once(pin_v)).sum()
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compare_value_is_a_millivolt() {
        let electronics = Electronics::new(1);
        assert!((electronics.drive_v(1900) - 1.9).abs() < 1e-12);
        assert!((electronics.drive_v(u16::MAX) - 4.25).abs() < 1e-12);
    }

    #[test]
    fn a_current_is_read_within_its_tolerance() {
        let mut electronics = Electronics::new(2);
        let mean = (0..1000)
            .map(|_| f64::from(electronics.sense_code(0, 6.25e-3)))
            .sum::<f64>()
            / 1e3;
        let expected = 32768.0 + 65536.0 / 101.0;
        // A gain of 0.3 % and an offset of 40 uV of 62 mV, 0.06 %: five deviations.
        assert!((mean / expected - 1.0).abs() < 15e-3, "{mean}");
        assert_eq!(electronics.sense_code(3, 1.0), 65520, "saturated");
    }
}
