//! A calibration: the numbers of the stages, per lane.

use crate::LANES;
use crate::table::InverseTable;
use crate::units::{Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Volt, Watt};

/// The stages' numbers of one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

    const fn implausible_field(&self) -> Option<&'static str> {
        if !is_above_zero(self.cold_resistance.0) {
            Some("cold_resistance")
        } else if !is_above_zero(self.tcr.0) {
            Some("tcr")
        } else if !is_above_zero(self.thermal_resistance.0) {
            Some("thermal_resistance")
        } else {
            None
        }
    }
}

impl Calibration {
    /// A calibration of four lanes that never drives above `max_drive`.
    ///
    /// # Errors
    /// Names the first number that is not finite and above zero.
    pub const fn new(
        lanes: [LaneCalibration; LANES],
        max_drive: Volt,
    ) -> Result<Self, CalibrationError> {
        if !is_above_zero(max_drive.0) {
            return Err(CalibrationError::MaxDrive);
        }
        // `for` is not const yet.
        let mut lane = 0;
        while lane < LANES {
            if let Some(field) = lanes[lane].implausible_field() {
                return Err(CalibrationError::Lane { lane, field });
            }
            lane += 1;
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
            |lowest, top| {
                if top < lowest { top } else { lowest }
            },
        )
    }
}

const fn is_above_zero(value: f32) -> bool {
    value.is_finite() && value > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane() -> LaneCalibration {
        LaneCalibration {
            cold_resistance: Ohm(360.0),
            tcr: PerKelvin(3.92e-3),
            thermal_resistance: KelvinPerWatt(5700.0),
            shape: InverseTable::new(Micrometre(170.0), core::array::from_fn(|i| i as f32))
                .expect("rising"),
        }
    }

    #[test]
    fn names_the_number_that_is_wrong() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let mut lanes = [lane(); LANES];
            lanes[2].tcr = PerKelvin(bad);
            let error = CalibrationError::Lane {
                lane: 2,
                field: "tcr",
            };
            assert_eq!(Calibration::new(lanes, Volt(3.5)), Err(error));
            assert_eq!(
                Calibration::new([lane(); LANES], Volt(bad)),
                Err(CalibrationError::MaxDrive)
            );
        }
    }

    #[test]
    fn the_range_is_what_every_lane_knows() {
        let mut lanes = [lane(); LANES];
        lanes[3].shape = InverseTable::new(Micrometre(150.0), core::array::from_fn(|i| i as f32))
            .expect("rising");
        let calibration = Calibration::new(lanes, Volt(3.5)).expect("plausible");
        assert_eq!(calibration.max_position(), Micrometre(150.0));
    }
}
