//! A calibration: the numbers of the stages, per actuator where the actuators differ.
//!
//! It says what the mirror does, in the direction of the physics; the core derives the inverses. A
//! stage that a mirror does not have is empty ([`Heat::INSTANT`], [`Memory::NONE`]), and the same code
//! then does nothing for it.

mod bytes;
mod error;
mod layout;
mod origin;
mod plausible;
mod stages;

pub use error::{CalibrationError, Field, Problem};
pub use layout::{BYTES, record_bytes};
pub use origin::{Label, Origin};
pub use plausible::FASTEST_SHARED;
pub use stages::{
    ActuatorCalibration, Bounds, FAST_POLES, Heat, LAGS, Lag, Lever, Memory, PLAYS, POLES, Path,
    Plate, Play, Residual, Resonance, SENSED_RISES, SLOW, SLOW_POLES, SensedRises,
};

use crate::CHANNELS;
use crate::units::{Micrometre, Volt};

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
    pub actuators: [ActuatorCalibration; CHANNELS],
    /// The stage `heat` in time.
    pub heat: Heat,
    /// The stage `memory`.
    pub memory: Memory,
    /// The stage `plate`.
    pub plate: Plate,
    /// How the mirror goes to a new position.
    pub path: Path,
    /// What protects it.
    pub bounds: Bounds,
    /// How many kelvins of a heater the actuators' bend counts one kelvin of the surroundings for; 0 where the resistances
    /// are not known well enough to tell the surroundings from them (`surroundings`).
    pub ambient_ratio: f32,
    /// What a heater's resistance tells more for each kelvin of rise by which the four are warmer in the mean than it is (K/K): the heat
    /// of plate and frame, which it sees by other weights than the bend does. 0 where no tilted poses have told it.
    pub sensed_crosstalk: f32,
    /// What it leaves unknown.
    pub residual: Residual,
}

impl Parts {
    /// What a kelvin of each actuator's heating adds to what drives the shared part of the poles: its watts over those of all four. What
    /// they stand on is warmed by watts, and one that loses more takes more of them for the same rise.
    pub fn shared_gains(&self) -> [f32; CHANNELS] {
        let watts = self
            .actuators
            .each_ref()
            .map(|actuator| 1.0 / actuator.thermal_resistance.0);
        let sum: f32 = watts.iter().sum();
        watts.map(|one| one / sum)
    }
}

impl Calibration {
    /// A calibration of these parts.
    ///
    /// # Errors
    /// Names the first number that no mirror can have.
    pub fn new(parts: Parts) -> Result<Self, CalibrationError> {
        parts.check()?;
        Ok(Self { parts })
    }

    /// What it is made of.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The four actuators.
    pub fn actuators(&self) -> &[ActuatorCalibration; CHANNELS] {
        &self.parts.actuators
    }

    /// Highest voltage that any actuator may drive.
    pub fn max_drive(&self) -> Volt {
        self.parts.bounds.drive
    }

    /// Top of the range, which the four actuators' tables share.
    pub fn max_position(&self) -> Micrometre {
        self.parts.actuators[0].shape.top()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::shape::{InverseTable, KNOTS};
    use crate::units::{
        Hertz, Kelvin, KelvinPerWatt, Ohm, PerKelvin, Second, SecondPerKelvin, Watt,
    };

    pub(crate) fn actuator(top_um: f32, top_k: f32) -> ActuatorCalibration {
        let knots = core::array::from_fn(|i| top_k * i as f32 / (KNOTS - 1) as f32);
        ActuatorCalibration {
            cold_resistance: Ohm(360.0),
            tcr: PerKelvin(3.92e-3),
            thermal_resistance: KelvinPerWatt(5700.0),
            loss_growth: PerKelvin(2e-3),
            slower_by: Second(0.0),
            shape: InverseTable::new(Micrometre(top_um), knots).expect("rising"),
            sensed_rises: SensedRises {
                top: Kelvin(top_k),
                knots: core::array::from_fn(|i| top_k * i as f32 / (SENSED_RISES - 1) as f32),
            },
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
            actuators: [-5e-5, 5e-5, 0.0, 1e-4].map(|slower_s| ActuatorCalibration {
                slower_by: Second(slower_s),
                ..actuator(170.0, 97.0)
            }),
            heat: Heat {
                fast: [lag(0.5, 1e-3), lag(0.3, 35e-3), lag(0.1, 0.2)],
                slow: [lag(0.06, 4.0), lag(0.04, 20.0)],
                shared: [0.0, 0.5, 0.25, 0.75, 1.0],
                beam_lag: Second(3e-4),
                time_growth: SecondPerKelvin(2e-6),
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
            plate: Plate::cross(Micrometre(480.0)),
            path: Path {
                move_time: Second(6e-3),
                resonance: Resonance {
                    frequency: Hertz(700.0),
                    quality: 30.0,
                },
            },
            bounds: Bounds {
                drive: Volt(3.5),
                power: Watt(40e-3),
                rise: Kelvin(130.0),
            },
            ambient_ratio: 1.02,
            sensed_crosstalk: -0.03,
            residual: Residual {
                piston: Micrometre(0.05),
                tried: Micrometre(150.0),
                part: 0.001,
                apart: 0.01,
                ambient_ratio: 0.05,
            },
        }
    }
}
