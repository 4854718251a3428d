//! What a waveform is, and which ones can be played.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Points that a board keeps for waveforms that are tables.
pub const POINTS: usize = 512;

/// Poses that fit into them.
pub const POSE_POINTS: usize = POINTS / 3;

/// A table's point of this size is one amplitude away from the offset.
pub const FULL_SCALE: i16 = i16::MAX;

/// Setpoints over time: `offset + amplitude * shape`, for so many cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Waveform {
    /// What is moved.
    pub quantity: Quantity,
    /// How it moves, between -1 and 1.
    pub shape: Shape,
    /// Middle of the movement, in um or V.
    pub offset: f32,
    /// Largest distance from the middle, in um or V.
    pub amplitude: f32,
    /// How often the shape is gone through, at least once.
    pub cycles: u32,
    /// Whether all channels are off after it, or stay where it ends.
    pub ends_off: bool,
    /// What is told of its course, for a camera or a digitiser to follow.
    pub triggers: Triggers,
}

/// What a waveform moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Quantity {
    /// The piston position (um).
    Position,
    /// The plate: its piston (um) as a position, and its tilts about x and y beside it. A table has three columns then, one after
    /// the other: the piston's points, and as many of each tilt.
    Pose {
        /// About x and y.
        tilts: [Tilt; 2],
    },
    /// The voltage of some actuators (V).
    Drive {
        /// Which of the four.
        active: [bool; 4],
        /// Voltage of the others.
        others_v: f32,
    },
}

/// How a tilt moves while the piston goes through its shape: `offset + amplitude * curve`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Tilt {
    /// Middle of the movement (rad).
    pub offset: f32,
    /// Largest distance from the middle (rad).
    pub amplitude: f32,
    /// The curve, between -1 and 1, along a sine or a triangle of the piston; a table has points of its own.
    pub curve: Curve,
    /// How often the curve is gone through in one cycle of the waveform.
    pub turns: u16,
    /// Where in the curve the cycle begins, a whole turn being 2^16.
    pub start: u16,
}

/// One turn of a tilt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Curve {
    /// A sine from its middle upwards.
    #[default]
    Sine,
    /// Straight lines up to 1, down to -1 and back to the middle.
    Triangle,
}

/// How often in a cycle something begins, evenly. A tick tells at most one beginning of each, and its pin falls in between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Triggers {
    /// Frames in a cycle; a table is one at most.
    pub frames: u16,
    /// Lines in a cycle; a table has none.
    pub lines: u16,
}

/// What begins in a tick, as bits: 1 a frame, 2 a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Trigger(u8);

impl Trigger {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// A frame.
    pub const FRAME: Self = Self(1);
    /// A line.
    pub const LINE: Self = Self(2);

    /// Everything that begins in either.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other` begins.
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// As bits: 1 a frame, 2 a line.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// From bits, of which others mean nothing.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & 3)
    }
}

/// How a waveform moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Shape {
    /// A sine from its middle upwards.
    Sine {
        /// Cycles a second.
        frequency_hz: f32,
    },
    /// Straight lines up to 1, down to -1 and back to the middle.
    Triangle {
        /// Cycles a second.
        frequency_hz: f32,
    },
    /// The board's table, each point held for its dwell.
    Steps(Table),
    /// The board's table, in a straight line from point to point, each taking one dwell.
    Lines(Table),
}

/// The part of the board's points that a waveform uses, and at what pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Table {
    /// How many points, from the first.
    pub points: u16,
    /// Control ticks from one to the next, at least 1.
    pub dwell_ticks: u32,
}

/// Why a waveform cannot be played.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flaw {
    /// Offset, amplitude or another number is not finite.
    NotANumber,
    /// The frequency is not between zero and a quarter of the control rate.
    Frequency,
    /// There are no cycles.
    NoCycles,
    /// The table is empty (a line needs two points), or longer than the board's.
    Points,
    /// A point lasts no tick.
    NoDwell,
    /// Frames or lines begin more often than at every other tick, or within a table.
    Triggers,
}

impl Waveform {
    /// Finds what is wrong with it on a board of `tick_hz` control ticks a second.
    ///
    /// # Errors
    /// The first flaw.
    pub fn check(&self, tick_hz: u32) -> Result<(), Flaw> {
        let beside = match self.quantity {
            Quantity::Position => [0.0; 4],
            Quantity::Pose { tilts: [x, y] } => [x.offset, x.amplitude, y.offset, y.amplitude],
            Quantity::Drive { others_v, .. } => [others_v, 0.0, 0.0, 0.0],
        };
        let numbers = [self.offset, self.amplitude];
        if !numbers.iter().chain(&beside).all(|n| n.is_finite()) {
            return Err(Flaw::NotANumber);
        }
        if self.cycles == 0 {
            return Err(Flaw::NoCycles);
        }
        match self.shape {
            Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
                self.check_turns(frequency_hz, tick_hz as f32)
            }
            Shape::Steps(table) => table.check(1, self),
            Shape::Lines(table) => table.check(2, self),
        }
    }

    fn check_turns(&self, frequency_hz: f32, tick_hz: f32) -> Result<(), Flaw> {
        let turns = match self.quantity {
            Quantity::Pose { tilts: [x, y] } => x.turns.max(y.turns).max(1),
            Quantity::Position | Quantity::Drive { .. } => 1,
        };
        // The negation takes what is no number, too.
        if !(frequency_hz > 0.0 && frequency_hz * f32::from(turns) <= tick_hz / 4.0) {
            return Err(Flaw::Frequency);
        }
        let most = self.triggers.frames.max(self.triggers.lines);
        let possible = frequency_hz * f32::from(most) <= tick_hz / 2.0;
        possible.then_some(()).ok_or(Flaw::Triggers)
    }
}

impl Table {
    fn check(&self, fewest: usize, waveform: &Waveform) -> Result<(), Flaw> {
        let most = match waveform.quantity {
            Quantity::Pose { .. } => POSE_POINTS,
            Quantity::Position | Quantity::Drive { .. } => POINTS,
        };
        if !(fewest..=most).contains(&usize::from(self.points)) {
            Err(Flaw::Points)
        } else if self.dwell_ticks == 0 {
            Err(Flaw::NoDwell)
        } else if waveform.triggers.frames > 1 || waveform.triggers.lines > 0 {
            Err(Flaw::Triggers)
        } else {
            Ok(())
        }
    }
}
