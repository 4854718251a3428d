//! What a sensed current tells: the resistance, and with it the temperature.

use crate::calibration::LaneCalibration;
use crate::units::{Ampere, Kelvin, Ohm, Volt};

/// Below this drive the current is too small to tell a resistance: 0.1 V makes 0.28 mA, of which a
/// bench's 2 uA of noise are 0.7 %, or 1.8 K.
pub const MIN_SENSE_DRIVE: Volt = Volt(0.1);

/// Below this a current is none: no resistance that a heater can have.
const NO_CURRENT: Ampere = Ampere(1e-6);

/// What one lane's current tells at the drive it was sensed at.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LaneSense {
    /// Heater resistance, V / I.
    pub resistance: Ohm,
    /// Temperature rise that this resistance implies under the lane's calibration.
    pub temperature_rise: Kelvin,
}

/// A heater read as its own thermometer: dT = (R / R0 - 1) / xi.
#[derive(Clone, Debug)]
pub(crate) struct Thermometer {
    kelvin_per_ohm: f32,
    cold_kelvin: f32,
}

impl Thermometer {
    pub(crate) fn new(lane: &LaneCalibration) -> Self {
        Self {
            kelvin_per_ohm: 1.0 / (lane.cold_resistance.0 * lane.tcr.0),
            cold_kelvin: 1.0 / lane.tcr.0,
        }
    }

    /// `None` where drive or current are too small to tell.
    pub(crate) fn read(&self, drive: Volt, current: Ampere) -> Option<LaneSense> {
        if !(drive.0 >= MIN_SENSE_DRIVE.0 && current.0 > NO_CURRENT.0) {
            return None;
        }
        let resistance = Ohm(drive.0 / current.0);
        Some(LaneSense {
            resistance,
            temperature_rise: Kelvin(resistance.0 * self.kelvin_per_ohm - self.cold_kelvin),
        })
    }
}
