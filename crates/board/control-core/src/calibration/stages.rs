//! The stages' numbers, and what some of them say forward.

use core::f32::consts::PI;

use crate::CHANNELS;
use crate::shape::InverseTable;
use crate::units::{
    Hertz, Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, SecondPerKelvin, Volt, Watt,
};

/// Thermal poles that are advanced at every control tick.
pub const FAST_POLES: usize = 3;
/// Thermal poles that are slow enough to be advanced now and then.
pub const SLOW_POLES: usize = 2;
/// All of them, the fast ones first.
pub const POLES: usize = FAST_POLES + SLOW_POLES;
/// Play operators of the hysteresis.
pub const PLAYS: usize = 4;
/// Lags of the creep.
pub const LAGS: usize = 4;
/// Knots of the temperature rise that a resistance tells. Straight lines between 17 leave a hundredth of a kelvin of the
/// paper's mirror, whose resistance bends most.
pub const SENSED_RISES: usize = 17;
/// What counts as slow: lags that go 0.2 % of what is left to go in four ticks, and less.
pub const SLOW: Second = Second(0.25);

/// The stages' numbers of one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorCalibration {
    /// Resistance at ambient, R0.
    pub cold_resistance: Ohm,
    /// Temperature coefficient of the resistance, xi.
    pub tcr: PerKelvin,
    /// Temperature rise per heating power at a small rise, R_T.
    pub thermal_resistance: KelvinPerWatt,
    /// By how much the heat loss grows with the temperature rise, g: the power that holds dT is
    /// dT (1 + g dT) / R_T.
    pub loss_growth: PerKelvin,
    /// By how much it is slower than the poles of all four say: on its way it takes besides, in kelvins of heating, this times the slope.
    /// Below zero it is quicker, as one is that loses more at the same heat capacity.
    pub slower_by: Second,
    /// Position to temperature rise. All four tables have the same top.
    pub shape: InverseTable,
    /// What the resistance tells where the mirror rests in the surroundings of the calibration.
    pub sensed_rises: SensedRises,
}

/// Temperature rise that a resistance tells by R0 and xi, over the stages' own rise, which is only as much a temperature as
/// displacement and power tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedRises {
    /// The stages' rise at the last knot.
    pub top: Kelvin,
    /// At equal steps of the stages' rise from 0 on (K).
    pub knots: [f32; SENSED_RISES],
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
    /// Part of each, the fast ones first, that the heating of all four actuators drives, as that of the frame they stand on, each in
    /// proportion to its watts; the rest is driven by the actuator's own. Of the first, which is the beam's, 0.
    pub shared: [f32; POLES],
    /// Time constant with which the beam follows its heater, whose temperature rise the poles tell: heat is on its way from one to
    /// the other. 0: it is as warm at once.
    pub beam_lag: Second,
    /// What the time constants grow by for each kelvin of the rise, as under a heat capacity that grows: on its way the heater takes
    /// besides, in kelvins of heating, this times rise times slope. Below zero a warm actuator is quicker.
    pub time_growth: SecondPerKelvin,
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
    /// Time in which the play operators let go of what they hold back while the mirror is held by the highest drive, as friction does
    /// where that trembles by its own rounding; in proportion longer at a lower one, so that nothing is let go at rest. 0: never.
    pub release: Second,
    /// Lags of the creep.
    pub creep: [Lag; LAGS],
}

/// Where an actuator acts on the plate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lever {
    /// Along the x axis, from the plate's centre.
    pub x: Micrometre,
    /// Along the y axis.
    pub y: Micrometre,
    /// Its part of the warp, in which the actuators move and the plate does not; the largest is 1.
    pub warp: f32,
}

/// The stage `plate`: how four actuators carry it. At actuator i it is at z + y_i tilt_x - x_i tilt_y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Actuator by actuator.
    pub levers: [Lever; CHANNELS],
}

/// The plate on its springs, at its lowest resonance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Its frequency without damping; 0 where none is known.
    pub frequency: Hertz,
    /// Its quality factor: half the inverse of the damping ratio.
    pub quality: f32,
}

/// How the mirror goes to a new position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// How long a move takes where no limit acts. Without a known resonance, five periods of the lowest one leave less than
    /// half a percent of the step as ringing.
    pub move_time: Second,
    /// What the way leads the plate through without ringing.
    pub resonance: Resonance,
}

/// What protects the mirror, actuator by actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Highest voltage.
    pub drive: Volt,
    /// Highest heating power.
    pub power: Watt,
    /// Highest temperature rise.
    pub rise: Kelvin,
}

/// What a calibration leaves unknown of a mirror at rest in the room where it was calibrated, as standard uncertainties
/// [JCGM 100:2008, 3.3.5].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Of the piston, at any height; 0 where nobody has said, and then no position has an uncertainty.
    pub piston: Micrometre,
    /// Up to here it was tried on the mirror; 0 where nobody has.
    pub tried: Micrometre,
    /// Of the piston besides, as a part of what it is beyond what was tried.
    pub part: f32,
    /// Of one actuator's displacement apart from the others', as a part of it: what tilts the plate.
    pub apart: f32,
    /// Of what a kelvin of the surroundings is worth (`Parts::ambient_ratio`).
    pub ambient_ratio: f32,
}

impl Residual {
    /// What nobody has said.
    pub const UNKNOWN: Self = Self {
        piston: Micrometre(0.0),
        tried: Micrometre(0.0),
        part: 0.0,
        apart: 0.0,
        ambient_ratio: 0.0,
    };

    /// Whether somebody has.
    pub fn is_known(&self) -> bool {
        self.piston.0 > 0.0
    }

    /// Whether somebody has tried it, and may follow from that how the mirror settles.
    pub fn is_tried(&self) -> bool {
        self.is_known() && self.tried.0 > 0.0
    }

    /// What was tried where nothing says so, of a range up to `top`: all of it where no part is left unknown.
    pub fn tried_wholly_or_not(&self, top: Micrometre) -> Micrometre {
        match self.is_known() && self.part == 0.0 {
            true => top,
            false => Micrometre(0.0),
        }
    }
}

impl Resonance {
    /// One that nobody has found.
    pub const UNKNOWN: Self = Self {
        frequency: Hertz(0.0),
        quality: 0.0,
    };

    /// Whether somebody has.
    pub fn is_known(&self) -> bool {
        self.frequency.0 > 0.0
    }

    /// How much later than its actuators the plate is on a steady way, 1 / (w Q); 0 where nobody knows.
    pub fn delay(&self) -> Second {
        Second(match self.is_known() {
            true => 1.0 / (2.0 * PI * self.frequency.0 * self.quality),
            false => 0.0,
        })
    }
}

impl SensedRises {
    /// Those that nobody has measured.
    pub const UNKNOWN: Self = Self {
        top: Kelvin(0.0),
        knots: [0.0; SENSED_RISES],
    };

    /// Whether somebody has.
    pub fn is_known(&self) -> bool {
        self.top.0 > 0.0
    }
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
            shared: [0.0; POLES],
            beam_lag: Second(0.0),
            time_growth: SecondPerKelvin(0.0),
        }
    };

    /// All poles, the fast ones first.
    pub fn poles(&self) -> [Lag; POLES] {
        let mut poles = [Lag::NONE; POLES];
        let lags = self.fast.iter().chain(&self.slow);
        for (pole, lag) in poles.iter_mut().zip(lags) {
            *pole = *lag;
        }
        poles
    }
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

impl Plate {
    /// One whose levers nobody knows: it is moved level only.
    pub const UNKNOWN: Self = Self::cross(Micrometre(0.0));

    /// Actuators 1 to 4 at +x, +y, -x and -y, all so far from the centre and equally stiff.
    pub const fn cross(lever: Micrometre) -> Self {
        const fn at(x: f32, y: f32, warp: f32) -> Lever {
            Lever {
                x: Micrometre(x),
                y: Micrometre(y),
                warp,
            }
        }
        let um = lever.0;
        Self {
            levers: [
                at(um, 0.0, 1.0),
                at(0.0, um, -1.0),
                at(-um, 0.0, 1.0),
                at(0.0, -um, -1.0),
            ],
        }
    }

    /// Whether the levers are known.
    pub fn is_known(&self) -> bool {
        let mut levers = self.levers.iter();
        levers.any(|lever| lever.x.0 != 0.0 || lever.y.0 != 0.0)
    }
}

impl ActuatorCalibration {
    /// Resistance at a temperature rise: R0 (1 + xi dT), the stage `resistance` forward.
    pub fn resistance(&self, rise: Kelvin) -> Ohm {
        Ohm(self.cold_resistance.0 * (1.0 + self.tcr.0 * rise.0))
    }

    /// Resistance of the heater that is not heated, in the room of the calibration. R0 and xi are a line through what it has where the mirror is
    /// used, which may begin elsewhere: by 24 ohm on virtual mirrors.
    pub fn resistance_at_rest(&self) -> Ohm {
        self.resistance(Kelvin(self.sensed_rises.knots[0]))
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
