//! What numbers a mirror can have.
//!
//! Three kinds: what the board's design allows (`design.rs`); what the stages' inverses need, so that none divides by next to
//! nothing; and all others, which keep out what is no mirror's, as a unit mixed up by a factor of a thousand or a bit that has flipped.
//! The last are choices, of whole powers of ten where one will do, with what each was reckoned from.

use core::ops::RangeInclusive;

use super::{ActuatorCalibration, Bounds, Heat, Memory, Parts, Plate, Residual, Resonance};
use super::{CalibrationError, Field, Problem};
use super::{FAST_POLES, Lag, Play, SLOW};
use crate::design::{COLD_RESISTANCES_OHM, HIGHEST_DRIVE, HIGHEST_POWER_W, TCRS_PER_K};
use crate::heat::LEAST_SLOWING;
use crate::plate::across;
use crate::units::{Second, Volt};

/// K/W. The paper's actuator has 5.7e3; the highest is over a thousand times that, and the lowest would warm by 0.4 mK at the highest
/// power, which is no heater.
const THERMAL_RESISTANCES_K_PER_W: RangeInclusive<f32> = 1e-2..=1e7;
/// 1/K. Air makes a loss grow by 2e-3 to 4e-3 (the effect `heat-loss-temperature`): 25 times that at most. Where it falls, the power still
/// rises with the temperature, 1 + 2 g dT > 0, up to twice [`HOTTEST_RISE`].
const LOSS_GROWTHS_PER_K: RangeInclusive<f32> = -1e-3..=1e-1;
/// What a stage may call a temperature rise (K). No heater is hotter than [`HOTTEST_RISE`], but displacement and resistance tell
/// temperatures only up to a factor ([`TCRS_PER_K`]): of four, which is 900 K, and five times that.
const RISES_K: RangeInclusive<f32> = 1e-1..=5e3;
/// Temperature rises that a resistance may tell (K): no more than the stages' own may be, and a little below none, by a line that was
/// fitted elsewhere.
const SENSED_RISES_K: RangeInclusive<f32> = -20.0..=*RISES_K.end();

/// How far the fast and slow poles' weights may add up to something else than 1: far above the rounding of five weights, and a tenth
/// of a percent of the displacement.
const WEIGHT_TOLERANCE: f32 = 1e-3;
/// The least weight of the fast poles: what is slow has been left out of the table's temperature when little is fast, and the inverse
/// divides by it. A choice: 19 times as much slow as fast, and no mirror known is near it.
const LEAST_FAST: f32 = 0.05;
/// The slowest pole (s): some 700 times the 14 s that the paper's loops and t95 allow for, a choice.
const SLOWEST_POLE: Second = Second(1e4);
/// The fastest pole that actuators may share: the core looks at what they share every 0.4 ms (`heat.rs`), and no chip frame is faster;
/// that of the paper's mirror takes 33 ms.
pub const FASTEST_SHARED: Second = Second(0.01);

/// Creep that is faster than this is none: a third of the paper's middle pole of 33 ms, a choice.
const FASTEST_CREEP: Second = Second(0.01);
/// Nor is any slower (s), or let go by friction: a day.
const SLOWEST_MEMORY: Second = Second(1e5);
/// A lag's part of the creep: all of them together are at most a fifth in the effect `creep`; either way, since lags that stand for
/// another law may have both signs.
const CREEP_WEIGHTS: RangeInclusive<f32> = -0.2..=0.2;
/// The least part of a motion that follows at once: the inverse of the plays divides by it, and asks for ten times the way at a turn.
const LEAST_AT_ONCE: f32 = 0.1;
/// A length that is no part of a mirror's motion (um): a centimetre, over fifty times the paper's 173.7 um.
const LONGEST_MOTION_UM: f32 = 1e4;
/// A range that is no mirror's (um): less than a micrometre is one in another unit.
const SHORTEST_RANGE_UM: f32 = 1.0;

/// How long a move may take (s): five periods of a resonance of 5 Hz, a twelfth of the lowest that the effect `resonance` knows.
const LONGEST_MOVE: Second = Second(1.0);
/// How slowly a beam may follow its heater (s). Led by 200 ticks, the rounding of 300 K in f32 grows to 6 mK, a hundredth of a micrometre.
const LONGEST_BEAM_LAG: Second = Second(0.02);
/// How much the time constants may have grown by at the highest rise, as a part of what a step's beginning tells of them: ten times is
/// more than any loss or heat capacity makes of them over the widest range.
const TIME_GROWTHS: RangeInclusive<f32> = LEAST_SLOWING..=10.0;
/// Quality factors of resonances: what is damped more than critically does not ring, and MEMS mirrors in air stay below the highest.
const QUALITIES: RangeInclusive<f32> = 0.5..=1e4;
/// What one kelvin of the surroundings may be worth, in kelvins of a heater: a beam whose heater is on one half only bends
/// twice as much with the whole, and half as much again; one that does not move with the room has nothing to be compensated.
const AMBIENT_RATIOS: RangeInclusive<f32> = 0.0..=3.0;
/// What a heater sees of the others' heat beyond what the bend does, in kelvins for each: virtual mirrors have -0.031 to 0.005; half of it
/// would be no thermometer of its own.
const SENSED_CROSSTALKS: RangeInclusive<f32> = -0.5..=0.5;
/// The lowest bound of a drive, one code of it (V), and of a power (W): less than a ten-thousandth of the 22.6 mW that the paper's
/// actuator takes at 3.5 V. Bounds below these would hold every drive at nothing.
const LEAST_DRIVE: Volt = Volt(1e-3);
const LEAST_POWER_W: f32 = 1e-6;

impl Parts {
    /// Names the first number that no mirror can have.
    pub(super) fn check(&self) -> Result<(), CalibrationError> {
        for (i, actuator) in self.actuators.iter().enumerate() {
            actuator.check().map_err(|error| error.of_actuator(i))?;
            let range = SHORTEST_RANGE_UM..=LONGEST_MOTION_UM;
            check(Field::Top, 0, actuator.shape.top().0, range)
                .map_err(|error| error.of_actuator(i))?;
            if actuator.shape.top() != self.actuators[0].shape.top() {
                let error = CalibrationError::number(Field::Top, 0, Problem::NotTheSame);
                return Err(error.of_actuator(i));
            }
        }
        self.heat.check()?;
        self.memory.check()?;
        self.plate.check()?;
        check(
            Field::MoveTime,
            0,
            self.path.move_time.0,
            0.0..=LONGEST_MOVE.0,
        )?;
        let beam_lag = self.heat.beam_lag.0;
        check(Field::BeamLag, 0, beam_lag, 0.0..=LONGEST_BEAM_LAG.0)?;
        self.path.resonance.check()?;
        check(Field::AmbientRatio, 0, self.ambient_ratio, AMBIENT_RATIOS)?;
        let crosstalk = self.sensed_crosstalk;
        check(Field::SensedCrosstalk, 0, crosstalk, SENSED_CROSSTALKS)?;
        if self.ambient_ratio > 0.0 {
            for (i, actuator) in self.actuators.iter().enumerate() {
                actuator
                    .check_sensed_rises()
                    .map_err(|error| error.of_actuator(i))?;
            }
        }
        self.residual.check()?;
        self.bounds.check()?;
        self.check_slowness()
    }

    /// What follows at once has no time constant that could grow, or be another than that of the other actuators.
    fn check_slowness(&self) -> Result<(), CalibrationError> {
        let used = self.heat.fast.iter().filter(|lag| lag.weight > 0.0);
        let initial_rate: f32 = used.map(|lag| lag.weight / lag.time.0).sum();
        let allowed = |unit: f32| TIME_GROWTHS.start() * unit..=TIME_GROWTHS.end() * unit;
        let initial_s = 1.0 / initial_rate;
        let growth = self.heat.time_growth.0;
        let growths = allowed(initial_s / self.bounds.rise.0);
        check_for(
            Problem::AtTheHighestRise,
            Field::TimeGrowth,
            growth,
            growths,
        )?;
        for (i, actuator) in self.actuators.iter().enumerate() {
            let cold = actuator.slower_by.0;
            let hot = cold + growth * self.bounds.rise.0;
            for slower in [cold, hot] {
                check(Field::SlowerBy, 0, slower, allowed(initial_s))
                    .map_err(|error| error.of_actuator(i))?;
            }
        }
        Ok(())
    }
}

impl Resonance {
    /// Frequencies that a way is shaped for (Hz): half a period of the lowest lasts no longer than the shaper remembers (`shaper.rs`), and
    /// a period of the highest has two ticks.
    pub const SHAPED_HZ: RangeInclusive<f32> = 80.0..=5e3;

    fn check(&self) -> Result<(), CalibrationError> {
        if *self == Self::UNKNOWN {
            return Ok(());
        }
        check(
            Field::ResonanceFrequency,
            0,
            self.frequency.0,
            Self::SHAPED_HZ,
        )?;
        check(Field::ResonanceQuality, 0, self.quality, QUALITIES)
    }
}

impl ActuatorCalibration {
    fn check(&self) -> Result<(), CalibrationError> {
        let cold_ohm = self.cold_resistance.0;
        check_board(Field::ColdResistance, cold_ohm, COLD_RESISTANCES_OHM)?;
        check_board(Field::Tcr, self.tcr.0, TCRS_PER_K)?;
        let at_rest_ohm = self.resistance_at_rest().0;
        check_board(Field::SensedRise, at_rest_ohm, COLD_RESISTANCES_OHM)?;
        check(
            Field::ThermalResistance,
            0,
            self.thermal_resistance.0,
            THERMAL_RESISTANCES_K_PER_W,
        )?;
        check(Field::LossGrowth, 0, self.loss_growth.0, LOSS_GROWTHS_PER_K)
    }
}

impl ActuatorCalibration {
    /// A heater that tells its temperature tells more where it is hotter.
    fn check_sensed_rises(&self) -> Result<(), CalibrationError> {
        check(Field::SensedTop, 0, self.sensed_rises.top.0, RISES_K)?;
        for (i, pair) in self.sensed_rises.knots.windows(2).enumerate() {
            if let [low, high] = *pair {
                let error = |problem| CalibrationError::number(Field::SensedRise, i + 1, problem);
                check(Field::SensedRise, i, low, SENSED_RISES_K)?;
                check(Field::SensedRise, i + 1, high, SENSED_RISES_K)?;
                if high <= low {
                    return Err(error(Problem::NotRising));
                }
            }
        }
        Ok(())
    }
}

impl Heat {
    fn check(&self) -> Result<(), CalibrationError> {
        check_lags(Field::FastPole, &self.fast, 0.0..=1.0, 0.0..=SLOW.0)?;
        check_lags(
            Field::SlowPole,
            &self.slow,
            0.0..=1.0 - LEAST_FAST,
            SLOW.0..=SLOWEST_POLE.0,
        )?;
        let weights = |lags: &[Lag]| lags.iter().map(|lag| lag.weight).sum::<f32>();
        let fast = weights(&self.fast);
        if (fast + weights(&self.slow) - 1.0).abs() > WEIGHT_TOLERANCE || fast < LEAST_FAST {
            return Err(CalibrationError::number(Field::FastPole, 0, Problem::Sum));
        }
        let mut own_fast = fast;
        for (i, (part, lag)) in self.shared.into_iter().zip(self.poles()).enumerate() {
            let is_shared = i > 0 && lag.time.0 >= FASTEST_SHARED.0;
            let most = if is_shared { 1.0 } else { 0.0 };
            check(Field::SharedPart, i, part, 0.0..=most)?;
            if i < FAST_POLES {
                own_fast -= part * lag.weight;
            }
        }
        if own_fast < LEAST_FAST {
            return Err(CalibrationError::number(Field::SharedPart, 0, Problem::Sum));
        }
        Ok(())
    }
}

impl Memory {
    fn check(&self) -> Result<(), CalibrationError> {
        let mut at_once = 1.0;
        let mut last_um = 0.0;
        for (i, Play { weight, radius }) in self.plays.into_iter().enumerate() {
            check(Field::Play, i, weight, 0.0..=1.0 - LEAST_AT_ONCE)?;
            check(Field::Play, i, radius.0, 0.0..=LONGEST_MOTION_UM)?;
            if radius.0 < last_um {
                return Err(CalibrationError::number(Field::Play, i, Problem::NotRising));
            }
            last_um = radius.0;
            at_once -= weight;
        }
        if at_once < LEAST_AT_ONCE {
            return Err(CalibrationError::number(Field::Play, 0, Problem::Sum));
        }
        check(Field::Release, 0, self.release.0, 0.0..=SLOWEST_MEMORY.0)?;
        check_lags(
            Field::Creep,
            &self.creep,
            CREEP_WEIGHTS,
            FASTEST_CREEP.0..=SLOWEST_MEMORY.0,
        )
    }
}

/// No mirror plate has a longer lever (um): MEMS mirrors are millimetres wide, and this is ten centimetres.
const LONGEST_LEVER_UM: f32 = 1e5;
/// The least volume that levers and warp span, as a part of that of a square plate: 1 in 10 is far from any layout, a choice; the inverse of
/// the plate divides by it.
const LEAST_SPANNED: f32 = 0.1;

impl Plate {
    fn check(&self) -> Result<(), CalibrationError> {
        let mut longest_um = 0.0;
        for (i, lever) in self.levers.iter().enumerate() {
            for um in [lever.x.0, lever.y.0] {
                check(Field::Lever, i, um, -LONGEST_LEVER_UM..=LONGEST_LEVER_UM)?;
                longest_um = if um.abs() > longest_um {
                    um.abs()
                } else {
                    longest_um
                };
            }
            check(Field::Lever, i, lever.warp, -1.0..=1.0)?;
        }
        if !self.is_known() {
            return Ok(());
        }
        let part = |um: f32| um / longest_um;
        let tilt_x = self.levers.map(|lever| part(lever.y.0));
        let tilt_y = self.levers.map(|lever| part(lever.x.0));
        let warp = self.levers.map(|lever| lever.warp);
        let volume: f32 = across([&tilt_x, &tilt_y, &warp]).iter().sum();
        // That of a square plate is 16.
        if volume.abs() < 16.0 * LEAST_SPANNED {
            return Err(CalibrationError::number(Field::Lever, 0, Problem::NoPlate));
        }
        Ok(())
    }
}

impl Residual {
    /// No mirror is off by more than a range, no part by more than the whole.
    fn check(&self) -> Result<(), CalibrationError> {
        check(Field::Residual, 0, self.piston.0, 0.0..=LONGEST_MOTION_UM)?;
        check(Field::Tried, 0, self.tried.0, 0.0..=LONGEST_MOTION_UM)?;
        let parts = [self.part, self.apart, self.ambient_ratio];
        for (i, part) in parts.into_iter().enumerate() {
            check(Field::Residual, i + 1, part, 0.0..=1.0)?;
        }
        Ok(())
    }
}

impl Bounds {
    fn check(&self) -> Result<(), CalibrationError> {
        check_board(
            Field::MaxDrive,
            self.drive.0,
            LEAST_DRIVE.0..=HIGHEST_DRIVE.0,
        )?;
        check_board(
            Field::MaxPower,
            self.power.0,
            LEAST_POWER_W..=HIGHEST_POWER_W,
        )?;
        check(Field::MaxRise, 0, self.rise.0, RISES_K)
    }
}

fn check_lags(
    field: Field,
    lags: &[Lag],
    weights: RangeInclusive<f32>,
    times: RangeInclusive<f32>,
) -> Result<(), CalibrationError> {
    for (i, lag) in lags.iter().enumerate() {
        check(field, i, lag.weight, weights.clone())?;
        check(field, i, lag.time.0, times.clone())?;
    }
    Ok(())
}

fn check(
    field: Field,
    index: usize,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), CalibrationError> {
    // NaN is in no range.
    if range.contains(&value) {
        Ok(())
    } else {
        Err(CalibrationError::number(field, index, Problem::OutOfRange))
    }
}

/// What the board's design allows, however plausible a number may be.
fn check_board(
    field: Field,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), CalibrationError> {
    check_for(Problem::BeyondTheBoard, field, value, range)
}

fn check_for(
    problem: Problem,
    field: Field,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), CalibrationError> {
    check(field, 0, value, range).map_err(|_| CalibrationError::number(field, 0, problem))
}

#[cfg(test)]
mod tests;
