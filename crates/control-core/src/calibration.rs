//! A calibration: the numbers of the stages, per lane.

use crate::LANES;
use crate::table::InverseTable;
use crate::units::{Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Volt, Watt};

/// The stages' numbers of one actuator.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneCalibration {
    /// Resistance at ambient, R0.
    pub cold_resistance: Ohm,
    /// Temperature coefficient of the resistance, xi.
    pub tcr: PerKelvin,
    /// Temperature rise per heating power, R_T.
    pub thermal_resistance: KelvinPerWatt,
    /// Position to temperature rise.
    pub shape: InverseTable,
}

/// A calibration of the whole mirror, with the limits that protect it.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    lanes: [LaneCalibration; LANES],
    max_drive: Volt,
}

/// Why a calibration is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationError {
    /// A number of a lane is not finite and above zero.
    Lane {
        /// Which lane, from 0.
        lane: usize,
        /// Which number.
        field: &'static str,
    },
    /// The highest drive is not finite and above zero.
    MaxDrive,
}

impl LaneCalibration {
    /// Resistance at a temperature rise: R0 (1 + xi dT), the stage `resistance` forward.
    pub fn resistance(&self, rise: Kelvin) -> Ohm {
        Ohm(self.cold_resistance.0 * (1.0 + self.tcr.0 * rise.0))
    }

    /// Temperature rise at a resistance, the stage `resistance` read backwards.
    pub fn temperature_rise(&self, resistance: Ohm) -> Kelvin {
        Kelvin((resistance.0 / self.cold_resistance.0 - 1.0) / self.tcr.0)
    }

    /// Power that holds a temperature rise, the inverse of the stage `heat`.
    pub fn power(&self, rise: Kelvin) -> Watt {
        Watt(rise.0 / self.thermal_resistance.0)
    }

    fn check(&self, lane: usize) -> Result<(), CalibrationError> {
        for (field, value) in [
            ("cold_resistance", self.cold_resistance.0),
            ("tcr", self.tcr.0),
            ("thermal_resistance", self.thermal_resistance.0),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(CalibrationError::Lane { lane, field });
            }
        }
        Ok(())
    }
}

impl Calibration {
    /// A calibration of four lanes that never drives above `max_drive`.
    ///
    /// # Errors
    /// Names the first number that is not finite and above zero.
    pub fn new(lanes: [LaneCalibration; LANES], max_drive: Volt) -> Result<Self, CalibrationError> {
        if !(max_drive.0.is_finite() && max_drive.0 > 0.0) {
            return Err(CalibrationError::MaxDrive);
        }
        for (index, lane) in lanes.iter().enumerate() {
            lane.check(index)?;
        }
        Ok(Self { lanes, max_drive })
    }

    /// The four lanes.
    pub fn lanes(&self) -> &[LaneCalibration; LANES] {
        &self.lanes
    }

    /// Highest voltage that any lane may drive.
    pub fn max_drive(&self) -> Volt {
        self.max_drive
    }

    /// Highest position that every lane knows.
    pub fn max_position(&self) -> Micrometre {
        self.lanes.iter().map(|lane| lane.shape.top()).fold(
            Micrometre(f32::INFINITY),
            |lowest, top| if top < lowest { top } else { lowest },
        )
    }
}
