//! What a waveform is, and which ones can be played.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Points that a board keeps for waveforms that are tables.
pub const POINTS: usize = 512;

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
}

/// What a waveform moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Quantity {
    /// The piston position (um).
    Position,
    /// The voltage of some actuators (V).
    Drive {
        /// Which of the four.
        active: [bool; 4],
        /// Voltage of the others.
        others_v: f32,
    },
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
}

impl Waveform {
    /// Finds what is wrong with it on a board of `tick_hz` control ticks a second.
    ///
    /// # Errors
    /// The first flaw.
    pub fn check(&self, tick_hz: u32) -> Result<(), Flaw> {
        let others = match self.quantity {
            Quantity::Position => 0.0,
            Quantity::Drive { others_v, .. } => others_v,
        };
        if ![self.offset, self.amplitude, others]
            .iter()
            .all(|number| number.is_finite())
        {
            return Err(Flaw::NotANumber);
        }
        if self.cycles == 0 {
            return Err(Flaw::NoCycles);
        }
        match self.shape {
            Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
                let possible = frequency_hz > 0.0 && frequency_hz <= tick_hz as f32 / 4.0;
                possible.then_some(()).ok_or(Flaw::Frequency)
            }
            Shape::Steps(table) => table.check(1),
            Shape::Lines(table) => table.check(2),
        }
    }
}

impl Table {
    fn check(&self, fewest: usize) -> Result<(), Flaw> {
        if !(fewest..=POINTS).contains(&usize::from(self.points)) {
            Err(Flaw::Points)
        } else if self.dwell_ticks == 0 {
            Err(Flaw::NoDwell)
        } else {
            Ok(())
        }
    }
}
