//! One actuator: from the displacement that its shape must give to volts, and what its current tells.

use fpu::sqrt;

use crate::calibration::{ActuatorCalibration, Parts, Path};
use crate::codes::PwmCode;
use crate::design::TICK;
use crate::drive::{Quantiser, highest_code};
use crate::heat::{HeatInverse, HeatState, SharedHeat};
use crate::lag::rate;
use crate::limits::{Limit, Limits};
use crate::memory::MemoryState;
use crate::resistance::{ActuatorSense, Correction, PROBE_DRIVE, Thermometer};
use crate::settling::{Decay, Way};
use crate::surroundings::Evidence;
use crate::units::{Ampere, Kelvin, Ohm, Second, Volt, Watt};

/// Part of the highest power by which a power may be below zero unnoticed: what 0.05 um take of 170, the static error of a usual mirror.
const NO_POWER: f32 = 3e-4;

/// Time constant with which an actuator catches up that a bound has held back, in periods of the resonance. It slows down as it comes
/// nearer; if it stopped at once the mirror would ring. After n = 5/4 of them what was held back rings by 1 / sqrt(1 + (2 pi n)^2) of
/// itself, an eighth.
const CATCHING_UP: f32 = 1.25;
/// Periods of a resonance that is not known in a move (`calibration`, `PERIODS`).
const PERIODS: f32 = 5.0;

/// That time constant.
pub(crate) fn catch_up_time(parts: &Parts) -> Second {
    let Path {
        move_time,
        resonance,
    } = &parts.path;
    Second(match resonance.is_known() {
        true => CATCHING_UP / resonance.frequency.0,
        false => CATCHING_UP / PERIODS * move_time.0,
    })
}

/// Numbers of one actuator, ready for use.
#[derive(Clone, Debug)]
struct Gains {
    watt_per_kelvin: f32,
    loss_growth: f32,
    /// By so many ticks it is slower than the poles say.
    slower: f32,
    cold_ohm: f32,
    ohm_per_kelvin: f32,
    thermometer: Thermometer,
}

/// Bounds, ready for use, and how an actuator goes on that one has held back.
#[derive(Clone, Debug)]
pub(crate) struct Rails {
    power: f32,
    least_power: f32,
    drive: f32,
    squared_drive: f32,
    /// The least drive: zero, or what shows a resistance.
    least_drive: f32,
    least_square: f32,
    highest_code: u16,
    /// Pole with which an actuator catches up.
    catch_up_pole: f32,
}

/// An actuator from one tick to the next.
#[derive(Clone, Debug)]
pub(crate) struct Actuator {
    gains: Gains,
    pub(crate) memory: MemoryState,
    pub(crate) heat: HeatState,
    /// The temperature rise at the start of this tick.
    rise: Kelvin,
    /// Temperature rise that it is to be short of what it is asked for at the end of this tick: what is left of a lag.
    lag: f32,
    /// The resistance at which the present drive began, without the correction.
    expected: Ohm,
    correction: Correction,
    quantiser: Quantiser,
}

impl Gains {
    fn new(actuator: &ActuatorCalibration) -> Self {
        Self {
            watt_per_kelvin: 1.0 / actuator.thermal_resistance.0,
            loss_growth: actuator.loss_growth.0,
            slower: actuator.slower_by.0 / TICK.0,
            cold_ohm: actuator.cold_resistance.0,
            ohm_per_kelvin: actuator.cold_resistance.0 * actuator.tcr.0,
            thermometer: Thermometer::new(actuator),
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
        Kelvin(power.0 / self.watt_per_kelvin - self.loss_growth * rise.0 * rise.0)
    }

    /// The rise that a power holds.
    fn held(&self, power: Watt) -> Kelvin {
        let unspread = power.0 / self.watt_per_kelvin;
        // dT (1 + g dT) = R_T P, without a difference that cancels; where no rise takes so much, the one that takes most.
        let square = 1.0 + 4.0 * self.loss_growth * unspread;
        let root = if square > 0.0 { sqrt(square) } else { 0.0 };
        Kelvin(2.0 * unspread / (1.0 + root))
    }
}

impl Rails {
    pub(crate) fn new(parts: &Parts) -> Self {
        let bounds = &parts.bounds;
        Self {
            power: bounds.power.0,
            least_power: -NO_POWER * bounds.power.0,
            drive: bounds.drive.0,
            squared_drive: bounds.drive.0 * bounds.drive.0,
            least_drive: 0.0,
            least_square: 0.0,
            highest_code: highest_code(bounds.drive),
            catch_up_pole: 1.0 - rate(catch_up_time(parts), 1),
        }
    }
}

impl Actuator {
    /// An actuator at rest.
    pub(crate) fn new(actuator: &ActuatorCalibration, memory: MemoryState) -> Self {
        Self {
            gains: Gains::new(actuator),
            memory,
            heat: HeatState::default(),
            rise: Kelvin(0.0),
            lag: 0.0,
            expected: actuator.cold_resistance,
            correction: Correction::NONE,
            quantiser: Quantiser::default(),
        }
    }

    /// Begins as warm as this, and with what it remembers.
    pub(crate) fn begin(&mut self, heat: HeatState, memory: MemoryState) {
        self.rise = heat.free_response();
        self.heat = heat;
        self.memory = memory;
    }

    /// Goes on as warm and with what it remembers, as another calibration describes it.
    pub(crate) fn recalibrate(&mut self, actuator: &ActuatorCalibration) {
        self.gains = Gains::new(actuator);
        self.expected = actuator.cold_resistance;
        self.correction = Correction::NONE;
        self.lag = 0.0;
    }

    /// What a heating is under another calibration: the one of the same power.
    pub(crate) fn worth_under(
        &self,
        next: &ActuatorCalibration,
    ) -> impl Fn(Kelvin) -> Kelvin + use<> {
        let (before, after) = (self.gains.clone(), Gains::new(next));
        move |heating| after.held(before.power(heating, heating))
    }

    /// What the current of the tick that ended tells, in the actuator's turn, which also corrects the resistance from now on.
    pub(crate) fn sense(&mut self, applied: Volt, current: Ampere) -> Option<ActuatorSense> {
        let sense = self.gains.thermometer.read(applied, current);
        match &sense {
            Some(sense) => self.correction.update(sense.resistance.0 / self.expected.0),
            None => self.correction.rest(),
        }
        sense
    }

    /// Whether its current has told no plausible resistance for long.
    pub(crate) fn is_resistance_unknown(&self) -> bool {
        self.correction.is_unknown()
    }

    /// What that tells of the surroundings, just before the slow poles' turn.
    pub(crate) fn evidence(
        &self,
        sense: &ActuatorSense,
        current: Ampere,
        mean_rise: Kelvin,
        (heat, shared): (&HeatInverse, &SharedHeat),
    ) -> Option<Evidence> {
        self.correction.tells().then(|| Evidence {
            sensed: sense.temperature_rise,
            rise: self.rise,
            mean_rise,
            unsettled: self.unsettled(heat, shared),
            held_back: Kelvin(self.lag),
            current,
        })
    }

    /// What its quick poles have still to bring, just before the slow poles' turn.
    pub(crate) fn unsettled(&self, heat: &HeatInverse, shared: &SharedHeat) -> Kelvin {
        heat.unsettled(&self.heat, shared, self.rise)
    }

    /// The drive of a tick that ends at the temperature rise `target`, or as near as the bounds allow and catching up does.
    #[inline(always)]
    pub(crate) fn heat_to(
        &mut self,
        target: Kelvin,
        heat: &HeatInverse,
        rails: &Rails,
        limits: &mut Limits,
    ) -> Volt {
        let aim = Kelvin(target.0 - self.lag);
        let mut heating = heat.heating(&self.heat, aim);
        let stored = heat.stored(self.gains.slower, self.rise, aim);
        let mut power = self.gains.power(Kelvin(heating.0 + stored.0), aim);
        let resistance = self.resistance();
        let square = power.0 * resistance.0;
        let drive = if rails.allow(square) && power.0 <= rails.power {
            self.rise = aim;
            self.lag *= rails.catch_up_pole;
            Volt(sqrt(square))
        } else {
            let drive = rails.limit(&mut power, resistance, limits);
            (heating, self.rise) = self.heating(power, heat);
            self.lag = (target.0 - self.rise.0) * rails.catch_up_pole;
            drive
        };
        heat.advance(&mut self.heat, heating);
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
        let (heating, rise) = self.heating(power, heat);
        heat.advance(&mut self.heat, heating);
        self.rise = rise;
        self.lag = 0.0;
        drive
    }

    /// What a power is to the poles from now on, and the rise that it makes in a tick.
    #[inline(always)]
    fn heating(&self, power: Watt, heat: &HeatInverse) -> (Kelvin, Kelvin) {
        let heating = self.gains.heating(power, self.rise);
        heat.unstored(self.gains.slower, &self.heat, heating, self.rise)
    }

    /// The code for `drive`.
    #[inline(always)]
    pub(crate) fn code(&mut self, drive: Volt, rails: &Rails) -> PwmCode {
        self.quantiser.code(drive, rails.highest_code)
    }

    /// The heating that takes it to `target` as fast as its bounds let it, or that keeps it where it is, which is near.
    pub(crate) fn heating_to(
        &self,
        target: Kelvin,
        near: Kelvin,
        rails: &Rails,
        heat: &HeatInverse,
    ) -> Kelvin {
        let apart = self.rise.0 - target.0;
        if apart.abs() <= near.0 {
            return heat.heating(&self.heat, self.rise);
        }
        let power = match apart > 0.0 {
            true => Watt(rails.least_square / self.corrected(self.gains.resistance(self.rise)).0),
            false => rails.most(self.corrected(self.gains.resistance(target))),
        };
        // The loss grows with the rise: at the target it is least on the way down, and most on the way up.
        self.gains.heating(power, target)
    }

    /// Ticks until it is near `target` at these heatings, its own and the mean of all four.
    pub(crate) fn arrival(
        &self,
        target: Kelvin,
        near: Kelvin,
        (heating, shared_heating): (Kelvin, Kelvin),
        (decay, shared): (&Decay, &SharedHeat),
    ) -> f32 {
        let way = Way {
            from: self.rise,
            to: target,
            near,
            heating,
            shared_heating,
        };
        decay.ticks(self.heat.parts(shared), &way)
    }

    /// Temperature rise now.
    pub(crate) fn rise(&self) -> Kelvin {
        self.rise
    }

    /// The resistance now, and a note of it for when its current has been sensed.
    fn resistance(&mut self) -> Ohm {
        self.expected = self.gains.resistance(self.rise);
        self.corrected(self.expected)
    }

    /// A resistance that its stages tell, as its current shows it.
    fn corrected(&self, expected: Ohm) -> Ohm {
        Ohm(expected.0 * self.correction.factor())
    }
}

impl Rails {
    /// Drives no less than what shows a resistance, or as little as is asked for.
    pub(crate) fn probe(&mut self, is_probing: bool) {
        self.least_drive = if is_probing { PROBE_DRIVE.0 } else { 0.0 };
        self.least_square = self.least_drive * self.least_drive;
    }

    /// The highest power at this resistance.
    fn most(&self, resistance: Ohm) -> Watt {
        let by_drive = self.squared_drive / resistance.0;
        Watt(if by_drive < self.power {
            by_drive
        } else {
            self.power
        })
    }

    /// Whether a drive of this square may be driven. As bits, what is below zero or no number is above every number.
    #[inline(always)]
    fn allow(&self, square: f32) -> bool {
        let above = |square: f32| square.to_bits().wrapping_sub(self.least_square.to_bits());
        above(square) <= above(self.squared_drive)
    }

    /// Holds `power` to what can be driven, and names what could not; returns the drive of that.
    fn limit(&self, power: &mut Watt, resistance: Ohm, limits: &mut Limits) -> Volt {
        if power.0 < self.least_power {
            limits.insert(Limit::Cooling);
        } else if power.0 * resistance.0 > self.least_square {
            // Not so for NaN.
            return self.limit_high(power, resistance, limits);
        }
        *power = Watt(self.least_square / resistance.0);
        Volt(self.least_drive)
    }

    /// The same of a power above the least.
    fn limit_high(&self, power: &mut Watt, resistance: Ohm, limits: &mut Limits) -> Volt {
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
