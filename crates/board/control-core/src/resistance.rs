//! The stage `resistance`: what a sensed current tells of it, and with it of the temperature, and the correction of
//! the model's resistance by the sensed one.

use crate::calibration::ActuatorCalibration;
use crate::limits::{Limit, Limits};
use crate::units::{Ampere, Kelvin, Ohm, Volt};

/// Below this drive the current is too small to tell a resistance: 0.1 V makes 0.28 mA, of which a
/// bench's 2 uA of noise are 0.7 %, or 1.8 K.
pub const MIN_SENSE_DRIVE: Volt = Volt(0.1);

/// Below this a current is none: no resistance that a heater can have.
const NO_CURRENT: Ampere = Ampere(1e-6);

/// What one actuator's current tells at the drive it was sensed at.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ActuatorSense {
    /// Heater resistance, V / I.
    pub resistance: Ohm,
    /// Temperature rise that this resistance implies under the actuator's calibration.
    pub temperature_rise: Kelvin,
}

/// The drive that shows a resistance where none is asked for: above [`MIN_SENSE_DRIVE`] by more than its rounding to codes.
pub(crate) const PROBE_DRIVE: Volt = Volt(0.11);

/// A heater read as its own thermometer: dT = (R / R0 - 1) / xi.
#[derive(Clone, Debug)]
pub(crate) struct Thermometer {
    kelvin_per_ohm: f32,
    cold_kelvin: f32,
}

impl Thermometer {
    pub(crate) fn new(actuator: &ActuatorCalibration) -> Self {
        Self {
            kelvin_per_ohm: 1.0 / (actuator.cold_resistance.0 * actuator.tcr.0),
            cold_kelvin: 1.0 / actuator.tcr.0,
        }
    }

    /// `None` where drive or current are too small to tell.
    pub(crate) fn read(&self, drive: Volt, current: Ampere) -> Option<ActuatorSense> {
        if !(drive.0 >= MIN_SENSE_DRIVE.0 && current.0 > NO_CURRENT.0) {
            return None;
        }
        let resistance = Ohm(drive.0 / current.0);
        Some(ActuatorSense {
            resistance,
            temperature_rise: Kelvin(resistance.0 * self.kelvin_per_ohm - self.cold_kelvin),
        })
    }
}

/// Sensed resistance over the model's: the first-order mean of recent ticks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correction {
    factor: f32,
    /// Ticks in succession that were not plausible.
    implausible: u8,
}

impl Correction {
    /// The model's resistance is right.
    pub(crate) const NONE: Self = Self {
        factor: 1.0,
        implausible: 0,
    };
    /// A resistance that is further from the model's is a fault or noise, or the drive of a step that is on its way through the
    /// output filter, and not warmth.
    const PLAUSIBLE: f32 = 0.25;
    /// So many ticks are waited for the drive to arrive. What is sensed is the drive of 2.6 ticks ago: two poles of the output
    /// filter, 0.16 ms, and the conversion's tick. A drive that rises from zero as the cube of time is within
    /// that of what it was then after 36 ticks, a step after three. What lasts longer is a fault or noise.
    const SETTLED: u8 = 40;
    /// Part of the way to a new reading that a tick goes: the mean of some eight.
    const PACE: f32 = 0.125;

    /// The factor from the model's resistance to the sensed one.
    pub(crate) fn factor(self) -> f32 {
        self.factor
    }

    /// Whether the last tick's was plausible.
    pub(crate) fn is_plausible(self) -> bool {
        self.implausible == 0
    }

    /// A tick that sensed `ratio` times the model's resistance.
    pub(crate) fn update(&mut self, ratio: f32, limits: &mut Limits) {
        let off = ratio - 1.0;
        if off.abs() < Self::PLAUSIBLE {
            self.factor += Self::PACE * (ratio - self.factor);
            self.implausible = 0;
        } else if self.implausible < Self::SETTLED {
            self.implausible += 1;
        } else {
            limits.insert(Limit::ResistanceUnknown);
            self.factor = 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a heater of `factor` times the model's resistance reads after a step from nothing, tick by tick, through two
    /// poles of 2 kHz.
    fn after_a_step(factor: f32) -> impl Iterator<Item = f32> {
        (1..50).map(move |tick| {
            let x = core::f64::consts::TAU * 2e3 * 1e-4 * f64::from(tick);
            let arrived = 1.0 - (1.0 + x) * (-x).exp();
            factor / arrived as f32
        })
    }

    #[test]
    fn a_step_through_the_output_filter_is_no_other_resistance() {
        let mut correction = Correction {
            factor: 1.1,
            ..Correction::NONE
        };
        let mut limits = Limits::default();
        for ratio in after_a_step(1.1) {
            correction.update(ratio, &mut limits);
            // The third tick's reading, 12 % off, comes in with an eighth, and the fourth's.
            assert!((correction.factor() - 1.1).abs() < 0.03, "{correction:?}");
        }
        assert!((correction.factor() - 1.1).abs() < 1e-3, "{correction:?}");
        assert_eq!(limits, Limits::default());
    }

    #[test]
    fn a_drive_that_rises_from_zero_is_no_other_resistance() {
        for power in 1..=3 {
            let (mut correction, mut limits) = (Correction::NONE, Limits::default());
            for tick in 3..200 {
                let sensed = (f64::from(tick) - 2.6) / f64::from(tick);
                correction.update((1.0 / sensed.powi(power)) as f32, &mut limits);
            }
            assert_eq!(limits, Limits::default(), "power {power}");
        }
    }

    #[test]
    fn what_stays_implausible_is_named_and_not_used() {
        let mut correction = Correction {
            factor: 1.1,
            ..Correction::NONE
        };
        let mut limits = Limits::default();
        for _ in 0..Correction::SETTLED {
            correction.update(2.0, &mut limits);
        }
        assert_eq!((correction.factor(), limits), (1.1, Limits::default()));
        correction.update(f32::NAN, &mut limits);
        assert_eq!(correction.factor(), 1.0);
        assert!(limits.contains(Limit::ResistanceUnknown));
    }
}
