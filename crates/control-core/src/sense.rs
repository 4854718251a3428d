//! What a sensed current tells: the resistance, and with it the temperature.

use crate::calibration::LaneCalibration;
use crate::units::{Ampere, Kelvin, Ohm, Volt};

/// Below this drive the current is too small to tell a resistance: 0.1 V makes 0.28 mA, of which a
/// bench's 2 uA of noise are 0.7 %, or 1.8 K.
pub const MIN_SENSE_DRIVE: Volt = Volt(0.1);

/// What one lane's current tells at the drive it was sensed at.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LaneSense {
    /// Heater resistance, V / I.
    pub resistance: Ohm,
    /// Temperature rise that this resistance implies under the lane's calibration.
    pub temperature_rise: Kelvin,
}

impl LaneSense {
    /// Reads the heater as its own thermometer; `None` where drive or current are too small to tell.
    pub fn read(lane: &LaneCalibration, drive: Volt, current: Ampere) -> Option<Self> {
        if !(drive >= MIN_SENSE_DRIVE && current.0 > 0.0) {
            return None;
        }
        let resistance = Ohm(drive.0 / current.0);
        resistance.0.is_finite().then(|| Self {
            resistance,
            temperature_rise: lane.temperature_rise(resistance),
        })
    }
}
