//! A calibration: the numbers of the stages, per lane where the lanes differ.
//!
//! It says what the mirror does, in the direction of the physics; the core derives the inverses. A
//! stage that a mirror does not have is empty ([`Heat::INSTANT`], [`Memory::NONE`]), and the same code
//! then does nothing for it.

mod bytes;
mod error;
mod origin;

pub use bytes::BYTES;
pub use error::{CalibrationError, Field, Problem};
pub use origin::{Label, Origin};

use core::ops::RangeInclusive;

use crate::LANES;
use crate::table::InverseTable;
use crate::units::{Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, Volt, Watt};

/// Thermal poles that are advanced at every control tick.
pub const FAST_POLES: usize = 3;
/// Thermal poles that are slow enough to be advanced now and then.
pub const SLOW_POLES: usize = 2;
/// Play operators of the hysteresis.
pub const PLAYS: usize = 4;
/// Lags of the creep.
pub const LAGS: usize = 4;
/// What counts as slow: time constants from here on.
pub const SLOW: Second = Second(0.25);

/// How far the fast and slow poles' weights may add up to something else than 1.
const WEIGHT_TOLERANCE: f32 = 1e-3;

/// The stages' numbers of one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneCalibration {
    /// Resistance at ambient, R0.
    pub cold_resistance: Ohm,
    /// Temperature coefficient of the resistance, xi.
    pub tcr: PerKelvin,
    /// Temperature rise per heating power at a small rise, R_T.
    pub thermal_resistance: KelvinPerWatt,
    /// By how much the heat loss grows with the temperature rise, g: the power that holds dT is
    /// dT (1 + g dT) / R_T.
    pub loss_growth: PerKelvin,
    /// Position to temperature rise. All four tables have the same top.
    pub shape: InverseTable,
}

/// A first-order lag with its weight in a sum of lags.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// Its part of the whole, 0 where it is not used.
    pub weight: f32,
    /// Its time constant; 0 follows at once.
    pub time: Second,
}

/// The stage `heat` in time: what the heating power will make in the end reaches the temperature
/// through a sum of lags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heat {
    /// Time constants below [`SLOW`].
    pub fast: [Lag; FAST_POLES],
    /// Time constants from [`SLOW`] on.
    pub slow: [Lag; SLOW_POLES],
}

/// A play operator with its weight: a part of the motion that follows only when pulled by more than
/// its radius.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Play {
    /// Its part of the motion, 0 where it is not used.
    pub weight: f32,
    /// How far the input gets ahead before it follows.
    pub radius: Micrometre,
}

/// The stage `memory`: hysteresis, and after it creep. With the displacement x that shape gives,
///
/// ```text
/// y = x + sum of weight (play(x) - x)      (Prandtl-Ishlinskii)
/// z = y + sum of weight lag(y)             (Kelvin-Voigt elements)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// Play operators, by rising radius.
    pub plays: [Play; PLAYS],
    /// Time in which the plays let go of what they hold back while nothing moves, as friction does in a mirror
    /// whose drive trembles by its own rounding; 0: never.
    pub release: Second,
    /// Lags of the creep.
    pub creep: [Lag; LAGS],
}

/// How the mirror goes to a new position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// How long a move takes where no limit acts. Five periods of the lowest resonance leave less than
    /// half a percent of the step as ringing.
    pub move_time: Second,
}

/// What protects the mirror, lane by lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Highest voltage.
    pub drive: Volt,
    /// Highest heating power.
    pub power: Watt,
    /// Highest temperature rise.
    pub rise: Kelvin,
}

/// A calibration of the whole mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    parts: Parts,
}

/// What a [`Calibration`] is made of, unchecked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// Which mirror it is for, and what it came from.
    pub origin: Origin,
    /// The four actuators.
    pub lanes: [LaneCalibration; LANES],
    /// The stage `heat` in time.
    pub heat: Heat,
    /// The stage `memory`.
    pub memory: Memory,
    /// How the mirror goes to a new position.
    pub path: Path,
    /// What protects it.
    pub bounds: Bounds,
}

impl Heat {
    /// Power becomes temperature at once.
    pub const INSTANT: Self = {
        let mut fast = [Lag::NONE; FAST_POLES];
        fast[0].weight = 1.0;
        Self {
            fast,
            slow: [Lag {
                weight: 0.0,
                time: SLOW,
            }; SLOW_POLES],
        }
    };
}

impl Lag {
    /// One that is not used.
    pub const NONE: Self = Self {
        weight: 0.0,
        time: Second(0.0),
    };
}

impl Memory {
    /// A displacement that remembers nothing.
    pub const NONE: Self = Self {
        plays: [Play {
            weight: 0.0,
            radius: Micrometre(0.0),
        }; PLAYS],
        release: Second(0.0),
        creep: [Lag {
            weight: 0.0,
            time: SLOW,
        }; LAGS],
    };
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

    /// Power that holds a temperature rise, the inverse of the stage `heat` at rest.
    pub fn power(&self, rise: Kelvin) -> Watt {
        Watt(rise.0 * (1.0 + self.loss_growth.0 * rise.0) / self.thermal_resistance.0)
    }
}

impl Calibration {
    /// A calibration of these parts.
    ///
    /// # Errors
    /// Names the first number that no mirror can have.
    pub fn new(parts: Parts) -> Result<Self, CalibrationError> {
        for (i, lane) in parts.lanes.iter().enumerate() {
            lane.check().map_err(|error| error.of_lane(i))?;
            if lane.shape.top() != parts.lanes[0].shape.top() {
                let error = CalibrationError::number(Field::Top, 0, Problem::NotTheSame);
                return Err(error.of_lane(i));
            }
        }
        parts.heat.check()?;
        parts.memory.check()?;
        check(Field::MoveTime, 0, parts.path.move_time.0, 0.0..=1.0)?;
        parts.bounds.check()?;
        Ok(Self { parts })
    }

    /// What it is made of.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The four lanes.
    pub fn lanes(&self) -> &[LaneCalibration; LANES] {
        &self.parts.lanes
    }

    /// Highest voltage that any lane may drive.
    pub fn max_drive(&self) -> Volt {
        self.parts.bounds.drive
    }

    /// Top of the range, which the four lanes' tables share.
    pub fn max_position(&self) -> Micrometre {
        self.parts.lanes[0].shape.top()
    }
}

impl LaneCalibration {
    fn check(&self) -> Result<(), CalibrationError> {
        check(Field::ColdResistance, 0, self.cold_resistance.0, 1e-2..=1e6)?;
        check(Field::Tcr, 0, self.tcr.0, 1e-6..=1e-1)?;
        check(
            Field::ThermalResistance,
            0,
            self.thermal_resistance.0,
            1e-2..=1e7,
        )?;
        check(Field::LossGrowth, 0, self.loss_growth.0, -1e-3..=1e-1)
    }
}

impl Heat {
    fn check(&self) -> Result<(), CalibrationError> {
        check_lags(Field::FastPole, &self.fast, 0.0..=1.0, 0.0..=SLOW.0)?;
        check_lags(Field::SlowPole, &self.slow, 0.0..=0.95, SLOW.0..=1e4)?;
        let weights = |lags: &[Lag]| lags.iter().map(|lag| lag.weight).sum::<f32>();
        let fast = weights(&self.fast);
        // What is slow has been left out of the table's temperature when little is fast.
        if (fast + weights(&self.slow) - 1.0).abs() > WEIGHT_TOLERANCE || fast < 0.05 {
            return Err(CalibrationError::number(Field::FastPole, 0, Problem::Sum));
        }
        Ok(())
    }
}

impl Memory {
    fn check(&self) -> Result<(), CalibrationError> {
        let mut at_once = 1.0;
        let mut last_um = 0.0;
        for (i, Play { weight, radius }) in self.plays.into_iter().enumerate() {
            check(Field::Play, i, weight, 0.0..=0.9)?;
            check(Field::Play, i, radius.0, 0.0..=1e4)?;
            if radius.0 < last_um {
                return Err(CalibrationError::number(Field::Play, i, Problem::NotRising));
            }
            last_um = radius.0;
            at_once -= weight;
        }
        if at_once < 0.1 {
            return Err(CalibrationError::number(Field::Play, 0, Problem::Sum));
        }
        check(Field::Release, 0, self.release.0, 0.0..=1e5)?;
        check_lags(Field::Creep, &self.creep, -0.2..=0.2, FASTEST_CREEP.0..=1e5)
    }
}

impl Bounds {
    fn check(&self) -> Result<(), CalibrationError> {
        check(Field::MaxDrive, 0, self.drive.0, 1e-3..=1e3)?;
        check(Field::MaxPower, 0, self.power.0, 1e-6..=1e3)?;
        check(Field::MaxRise, 0, self.rise.0, 1e-1..=5e3)
    }
}

/// Creep that is faster than this is none.
const FASTEST_CREEP: Second = Second(0.01);

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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::table::KNOTS;
    use proptest::prelude::*;

    pub(crate) fn lane(top_um: f32, top_k: f32) -> LaneCalibration {
        let knots = core::array::from_fn(|i| top_k * i as f32 / (KNOTS - 1) as f32);
        LaneCalibration {
            cold_resistance: Ohm(360.0),
            tcr: PerKelvin(3.92e-3),
            thermal_resistance: KelvinPerWatt(5700.0),
            loss_growth: PerKelvin(2e-3),
            shape: InverseTable::new(Micrometre(top_um), knots).expect("rising"),
        }
    }

    /// A mirror with everything in it.
    pub(crate) fn parts() -> Parts {
        let lag = |weight, time| Lag {
            weight,
            time: Second(time),
        };
        let play = |weight, radius| Play {
            weight,
            radius: Micrometre(radius),
        };
        Parts {
            origin: Origin {
                device: Label::new("mirror 7").expect("short"),
                date: Label::new("2026-11-21").expect("short"),
                model_hash: 0x0123_4567_89ab_cdef,
            },
            lanes: [lane(170.0, 97.0); LANES],
            heat: Heat {
                fast: [lag(0.5, 1e-3), lag(0.3, 35e-3), lag(0.1, 0.2)],
                slow: [lag(0.06, 4.0), lag(0.04, 20.0)],
            },
            memory: Memory {
                plays: [
                    play(0.01, 3.0),
                    play(0.01, 6.0),
                    play(0.01, 12.0),
                    play(0.01, 24.0),
                ],
                release: Second(0.5),
                creep: [
                    lag(0.004, 0.5),
                    lag(0.003, 2.0),
                    lag(0.002, 8.0),
                    lag(0.002, 25.0),
                ],
            },
            path: Path {
                move_time: Second(6e-3),
            },
            bounds: Bounds {
                drive: Volt(3.5),
                power: Watt(40e-3),
                rise: Kelvin(130.0),
            },
        }
    }

    #[test]
    fn the_lanes_share_their_range() {
        let mut parts = parts();
        parts.lanes[3] = lane(150.0, 97.0);
        let refused = CalibrationError::number(Field::Top, 0, Problem::NotTheSame).of_lane(3);
        assert_eq!(Calibration::new(parts), Err(refused));
    }

    /// One number off at a time, and the name under which it is refused.
    fn number_off(which: usize, bad: f32) -> (Parts, Field) {
        let mut p = parts();
        let (number, field) = match which {
            0 => (&mut p.lanes[2].cold_resistance.0, Field::ColdResistance),
            1 => (&mut p.lanes[0].tcr.0, Field::Tcr),
            2 => (
                &mut p.lanes[3].thermal_resistance.0,
                Field::ThermalResistance,
            ),
            3 => (&mut p.lanes[1].loss_growth.0, Field::LossGrowth),
            4 => (&mut p.heat.fast[1].weight, Field::FastPole),
            5 => (&mut p.heat.fast[2].time.0, Field::FastPole),
            6 => (&mut p.heat.slow[0].weight, Field::SlowPole),
            7 => (&mut p.heat.slow[1].time.0, Field::SlowPole),
            8 => (&mut p.memory.plays[3].weight, Field::Play),
            9 => (&mut p.memory.plays[0].radius.0, Field::Play),
            10 => (&mut p.memory.creep[1].weight, Field::Creep),
            11 => (&mut p.memory.creep[2].time.0, Field::Creep),
            12 => (&mut p.memory.release.0, Field::Release),
            13 => (&mut p.path.move_time.0, Field::MoveTime),
            14 => (&mut p.bounds.drive.0, Field::MaxDrive),
            15 => (&mut p.bounds.power.0, Field::MaxPower),
            _ => (&mut p.bounds.rise.0, Field::MaxRise),
        };
        *number = bad;
        (p, field)
    }

    proptest! {
        #[test]
        fn a_number_that_is_off_is_named(
            which in 0_usize..17,
            bad in prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(-1.0e3), Just(1e9)],
        ) {
            let (parts, field) = number_off(which, bad);
            let Err(CalibrationError::Number { field: named, .. }) = Calibration::new(parts) else {
                return Err(TestCaseError::fail("it was accepted"));
            };
            prop_assert_eq!(named, field);
        }
    }

    #[test]
    fn weights_must_add_up() {
        let mut heat = parts();
        heat.heat.fast[0].weight = 0.4;
        let mut plays = parts();
        plays.memory.plays[3].weight = 0.89;
        for (parts, field) in [(heat, Field::FastPole), (plays, Field::Play)] {
            let refused = CalibrationError::number(field, 0, Problem::Sum);
            assert_eq!(Calibration::new(parts), Err(refused));
        }
        let mut radii = parts();
        radii.memory.plays[2].radius = Micrometre(5.0);
        let refused = CalibrationError::number(Field::Play, 2, Problem::NotRising);
        assert_eq!(Calibration::new(radii), Err(refused));
    }

    #[test]
    fn what_is_not_there_is_allowed() {
        let mut empty = parts();
        empty.heat = Heat::INSTANT;
        empty.memory = Memory::NONE;
        assert!(Calibration::new(empty).is_ok());
    }
}
