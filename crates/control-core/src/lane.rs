//! One actuator: from the displacement that its shape must give to volts, and what its current tells.

use fpu::sqrt;

use crate::calibration::{Bounds, LaneCalibration};
use crate::codes::PwmCode;
use crate::heat::{HeatInverse, HeatState};
use crate::limits::{Limit, Limits};
use crate::output::{Rounding, highest_code};
use crate::sense::{LaneSense, Thermometer};
use crate::units::{Ampere, Kelvin, Ohm, Volt, Watt};

/// Part of the highest power by which a power may be below zero unnoticed: it is rounding at rest.
const NO_POWER: f32 = 2e-3;

/// Numbers of one actuator, ready for use.
#[derive(Clone, Debug)]
struct LaneGains {
    thermal_resistance: f32,
    watt_per_kelvin: f32,
    loss_growth: f32,
    cold_ohm: f32,
    ohm_per_kelvin: f32,
    thermometer: Thermometer,
}

/// Bounds, ready for use.
#[derive(Clone, Debug)]
pub(crate) struct Rails {
    power: f32,
    least_power: f32,
    drive: f32,
    squared_drive: f32,
    highest_code: u16,
}

/// An actuator from one tick to the next.
#[derive(Clone, Debug)]
pub(crate) struct Lane {
    gains: LaneGains,
    pub(crate) heat: HeatState,
    /// The temperature rise at the start of this tick.
    rise: Kelvin,
    /// The resistance at which the present drive began, without the correction.
    expected: Ohm,
    correction: Correction,
    rounding: Rounding,
}

/// Sensed resistance over the model's.
#[derive(Clone, Copy, Debug)]
struct Correction(f32);

impl LaneGains {
    fn new(lane: &LaneCalibration) -> Self {
        Self {
            thermal_resistance: lane.thermal_resistance.0,
            watt_per_kelvin: 1.0 / lane.thermal_resistance.0,
            loss_growth: lane.loss_growth.0,
            cold_ohm: lane.cold_resistance.0,
            ohm_per_kelvin: lane.cold_resistance.0 * lane.tcr.0,
            thermometer: Thermometer::new(lane),
        }
    }

    fn resistance(&self, rise: Kelvin) -> Ohm {
        Ohm(self.cold_ohm + self.ohm_per_kelvin * rise.0)
    }

    /// The power for a heating at a temperature: dT + what the loss has grown by, over R_T.
    fn power(&self, heating: Kelvin, rise: Kelvin) -> Watt {
        Watt((heating.0 + self.loss_growth * rise.0 * rise.0) * self.watt_per_kelvin)
    }

    fn heating(&self, power: Watt, rise: Kelvin) -> Kelvin {
        Kelvin(power.0 * self.thermal_resistance - self.loss_growth * rise.0 * rise.0)
    }
}

impl Rails {
    pub(crate) fn new(bounds: &Bounds) -> Self {
        Self {
            power: bounds.power.0,
            least_power: -NO_POWER * bounds.power.0,
            drive: bounds.drive.0,
            squared_drive: bounds.drive.0 * bounds.drive.0,
            highest_code: highest_code(bounds.drive),
        }
    }
}

impl Lane {
    /// An actuator at rest.
    pub(crate) fn new(lane: &LaneCalibration) -> Self {
        Self {
            gains: LaneGains::new(lane),
            heat: HeatState::default(),
            rise: Kelvin(0.0),
            expected: lane.cold_resistance,
            correction: Correction(1.0),
            rounding: Rounding::default(),
        }
    }

    /// What the current of the tick that ended tells, which also corrects the resistance from now on.
    pub(crate) fn sense(
        &mut self,
        applied: Volt,
        current: Ampere,
        limits: &mut Limits,
    ) -> Option<LaneSense> {
        let sense = self.gains.thermometer.read(applied, current)?;
        self.correction
            .update(sense.resistance.0 / self.expected.0, limits);
        Some(sense)
    }

    /// The drive of a tick that ends at the temperature rise `target`.
    #[inline(always)]
    pub(crate) fn heat_to(
        &mut self,
        target: Kelvin,
        heat: &HeatInverse,
        rails: &Rails,
        limits: &mut Limits,
    ) -> Volt {
        let mut heating = heat.heating(&self.heat, target);
        let mut power = self.gains.power(heating, target);
        let resistance = self.resistance();
        let square = power.0 * resistance.0;
        let drive = if power.0 > 0.0 && power.0 <= rails.power && square <= rails.squared_drive {
            Volt(sqrt(square))
        } else {
            let drive = rails.limit(&mut power, resistance, limits);
            heating = self.gains.heating(power, self.rise);
            drive
        };
        self.rise = heat.advance(&mut self.heat, heating);
        drive
    }

    /// A tick at `drive`, as far as it is allowed.
    pub(crate) fn drive(
        &mut self,
        drive: Volt,
        heat: &HeatInverse,
        rails: &Rails,
        limits: &mut Limits,
    ) -> Volt {
        let highest = (rails.drive, Limit::DriveHigh);
        let drive = Volt(limits.clamp(drive.0, (0.0, Limit::DriveLow), highest));
        let power = Watt(drive.0 * drive.0 / self.resistance().0);
        let heating = self.gains.heating(power, self.rise);
        self.rise = heat.advance(&mut self.heat, heating);
        drive
    }

    /// The code for `drive`, with what rounding has left so far.
    #[inline(always)]
    pub(crate) fn code(&mut self, drive: Volt, rails: &Rails) -> PwmCode {
        self.rounding.code(drive, rails.highest_code)
    }

    /// Temperature rise now.
    pub(crate) fn rise(&self) -> Kelvin {
        self.rise
    }

    /// The resistance now, and a note of it for when its current has been sensed.
    fn resistance(&mut self) -> Ohm {
        self.expected = self.gains.resistance(self.rise);
        Ohm(self.expected.0 * self.correction.0)
    }
}

impl Rails {
    /// Holds `power` to what can be driven, and names what could not.
    fn limit(&self, power: &mut Watt, resistance: Ohm, limits: &mut Limits) -> Volt {
        if power.0 <= 0.0 {
            if power.0 < self.least_power {
                limits.insert(Limit::Cooling);
            }
            *power = Watt(0.0);
            return Volt(0.0);
        }
        if power.0 > self.power {
            limits.insert(Limit::PowerHigh);
            *power = Watt(self.power);
        }
        let square = power.0 * resistance.0;
        if square > self.squared_drive {
            limits.insert(Limit::DriveHigh);
            *power = Watt(self.squared_drive / resistance.0);
            return Volt(self.drive);
        }
        Volt(sqrt(square))
    }
}

impl Correction {
    /// A resistance that is further from the model's is a fault or noise, and not warmth.
    const PLAUSIBLE: f32 = 0.25;
    /// Part of the way to a new reading that a tick goes: the mean of some eight.
    const PACE: f32 = 0.125;

    fn update(&mut self, ratio: f32, limits: &mut Limits) {
        let off = ratio - 1.0;
        if off < Self::PLAUSIBLE && off > -Self::PLAUSIBLE {
            self.0 += Self::PACE * (ratio - self.0);
        } else {
            limits.insert(Limit::ResistanceUnknown);
            *self = Self(1.0);
        }
    }
}
