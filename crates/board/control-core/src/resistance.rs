//! The stage `resistance`: what a sensed current tells of it, and with it of the temperature, and the correction of
//! the model's resistance by the sensed one.

use crate::calibration::ActuatorCalibration;
use crate::lag::TURNS;
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
pub const PROBE_DRIVE: Volt = Volt(0.11);

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

/// Sensed resistance over the model's: the first-order mean of recent readings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correction {
    factor: f32,
    /// Readings in succession that were not plausible.
    implausible: u8,
    /// Readings since the heater is driven, up to [`Self::ARRIVED`].
    driven: u8,
}

impl Correction {
    /// The model's resistance is right.
    pub(crate) const NONE: Self = Self {
        factor: 1.0,
        implausible: 0,
        driven: 0,
    };
    /// A resistance that is further from the model's is a fault or noise, or the drive of a step that is on its way through the
    /// output filter, and not warmth: the farthest surroundings that are followed, 63 K (`surroundings/filter.rs`), change a cold
    /// heater of 0.39 %/K by so much.
    const PLAUSIBLE: f32 = 0.25;
    /// So many readings, 40 ticks, are waited for the drive to arrive. What is sensed is the drive of 2.6 ticks ago: two poles of the output
    /// filter, 0.16 ms, and the conversion's tick. A drive that rises from zero as the cube of time is within
    /// that of what it was then after 36 ticks, a step after three. What lasts longer is a fault or noise.
    const SETTLED: u8 = (40 / TURNS) as u8;
    /// The third reading of a heater that was not driven before is the first that tells a temperature: it comes eight ticks after the
    /// drive at the earliest, when the drive has arrived to 0.05 %, 0.1 K; the second may be 4 % off, 10 K.
    const ARRIVED: u8 = 3;
    /// Part of the way to a new reading that is gone at once: the mean of some four. One reading on a drive's way through the
    /// output filter, 12 % off, makes 3 % of it.
    const PACE: f32 = 0.25;

    /// The factor from the model's resistance to the sensed one.
    pub(crate) fn factor(self) -> f32 {
        self.factor
    }

    /// Whether the last reading tells a temperature: it was plausible, and all of the drive has arrived.
    pub(crate) fn tells(self) -> bool {
        self.implausible == 0 && self.driven == Self::ARRIVED
    }

    /// Nothing is driven.
    pub(crate) fn rest(&mut self) {
        self.driven = 0;
    }

    /// Whether readings are not plausible, and have not been for as long as a drive may be on its way.
    pub(crate) fn is_unknown(self) -> bool {
        self.implausible >= Self::SETTLED
    }

    /// A reading of `ratio` times the model's resistance, once in [`TURNS`] ticks.
    pub(crate) fn update(&mut self, ratio: f32) {
        if self.driven < Self::ARRIVED {
            self.driven += 1;
        }
        let off = ratio - 1.0;
        if off.abs() < Self::PLAUSIBLE {
            self.factor += Self::PACE * (ratio - self.factor);
            self.implausible = 0;
        } else if self.is_unknown() {
            self.factor = 1.0;
        } else {
            self.implausible += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a heater of `factor` times the model's resistance reads after a step from nothing, turn by turn, through two
    /// poles of 2 kHz; the first after so many ticks.
    fn after_a_step(factor: f32, first: u8) -> impl Iterator<Item = f32> {
        (first..50).step_by(TURNS).map(move |tick| {
            let x = core::f64::consts::TAU * 2e3 * 1e-4 * f64::from(tick);
            let arrived = 1.0 - (1.0 + x) * (-x).exp();
            factor / arrived as f32
        })
    }

    #[test]
    fn a_step_through_the_output_filter_is_no_other_resistance() {
        for first in 1..=TURNS as u8 {
            let mut correction = Correction {
                factor: 1.1,
                ..Correction::NONE
            };
            for ratio in after_a_step(1.1, first) {
                correction.update(ratio);
                // The third tick's reading, 12 % off, comes in with a quarter.
                assert!((correction.factor() - 1.1).abs() < 0.035, "{correction:?}");
                assert!(!correction.is_unknown());
            }
            assert!((correction.factor() - 1.1).abs() < 2e-3, "{correction:?}");
        }
    }

    #[test]
    fn a_step_tells_a_temperature_when_all_of_it_has_arrived() {
        for first in 1..=TURNS as u8 {
            let mut correction = Correction::NONE;
            for ratio in after_a_step(1.0, first) {
                correction.update(ratio);
                // A tenth of a kelvin of 260 K, the inverse of the films' coefficient.
                assert!(!correction.tells() || ratio < 1.0 + 0.1 / 260.0, "{ratio}");
            }
            assert!(correction.tells());
            correction.rest();
            correction.update(1.0);
            assert!(!correction.tells(), "another step");
        }
    }

    #[test]
    fn a_drive_that_rises_from_zero_is_no_other_resistance() {
        for power in 1..=3 {
            let mut correction = Correction::NONE;
            for tick in (3..200).step_by(TURNS) {
                let sensed = (f64::from(tick) - 2.6) / f64::from(tick);
                correction.update((1.0 / sensed.powi(power)) as f32);
                assert!(!correction.is_unknown(), "power {power}, tick {tick}");
            }
        }
    }

    #[test]
    fn what_stays_implausible_is_named_and_not_used() {
        let mut correction = Correction {
            factor: 1.1,
            ..Correction::NONE
        };
        for _ in 0..Correction::SETTLED {
            assert!(!correction.is_unknown());
            correction.update(2.0);
        }
        assert_eq!(correction.factor(), 1.1);
        correction.update(f32::NAN);
        assert_eq!(correction.factor(), 1.0);
        assert!(correction.is_unknown());
        correction.update(1.1);
        assert!(!correction.is_unknown());
    }
}
