//! What is asked for and no board, or not this one, can do.

use quantities::{Frequency, Length, Resistance, Span, Voltage};

use crate::tilted_pose::TiltedPose;

/// What is asked for and no board, or not this one, can do. It was not asked to.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum BeyondBoard {
    #[error("{asked} is beyond the range of this board, 0 to {max}; nothing was moved")]
    #[diagnostic(help("ask for a position within the range"))]
    PositionOutOfRange { asked: Length, max: Length },

    #[error(
        "{asked} is out of reach: the mirror rests at {lowest} in this room, which is warmer than at calibration; nothing was moved"
    )]
    #[diagnostic(help(
        "a heater cannot cool: the nearest position that can be reached is {lowest}; `host-tool explain room-warm`. Where `calibration-drifted` is told, too, \
         a heater has changed and not the room: calibrate again"
    ))]
    PositionBelowRoom { asked: Length, lowest: Length },

    #[error("{asked} is out of reach of this mirror; nothing was moved")]
    #[diagnostic(help(
        "the nearest pose in reach is {nearest}; `host-tool range` shows all of them"
    ))]
    PoseOutOfReach {
        asked: Box<TiltedPose>,
        nearest: Box<TiltedPose>,
    },

    #[error(
        "{asked} is out of reach: heat of the others keeps actuator {actuator} too warm for it; nothing was moved"
    )]
    #[diagnostic(help(
        "the nearest pose in reach is {nearest}; a heater cannot cool, and `host-tool range` shows all that are"
    ))]
    PoseKeptWarm {
        asked: Box<TiltedPose>,
        nearest: Box<TiltedPose>,
        actuator: usize,
    },

    #[error(
        "{asked} is out of reach: actuator {actuator} would take more than the highest drive; nothing was moved"
    )]
    #[diagnostic(help(
        "the nearest pose in reach is {nearest}; with colder ones around it an actuator takes more than on a level plate, and `host-tool \
         range` shows all that are"
    ))]
    PoseBeyondDrives {
        asked: Box<TiltedPose>,
        nearest: Box<TiltedPose>,
        actuator: usize,
    },

    #[error(
        "no tilt can be asked for: the calibration in use does not know the plate's levers; nothing was moved"
    )]
    #[diagnostic(help(
        "`host-tool calibrate-pose` measures the levers; piston motion needs none: `host-tool set-z`"
    ))]
    LeversUnknown,

    #[error("there are no tilts to draw: the calibration in use does not know the plate's levers")]
    #[diagnostic(help(
        "`host-tool range` without --picture tells which positions are reached; `host-tool calibrate-pose` measures the levers"
    ))]
    NoTiltsToDraw,

    #[error("{asked} is beyond what this board drives, 0 to {max}; nothing was changed")]
    #[diagnostic(help("ask for voltages within the limits"))]
    DriveOutOfRange { asked: Voltage, max: Voltage },

    #[error("a mirror has four actuators, and {count} voltages were given; nothing was changed")]
    #[diagnostic(help("give one voltage for all four actuators, or one for each of them"))]
    DriveCount { count: usize },

    #[error("samples cannot come every {asked}: the board takes {tick} to {longest}")]
    #[diagnostic(help("ask for another period"))]
    Period {
        asked: Span,
        tick: Span,
        longest: Span,
    },

    #[error("samples cannot come every {asked}: the board takes one after whole ticks of {tick}")]
    #[diagnostic(help("ask for {shorter} or {longer}"))]
    PartOfTick {
        asked: Span,
        tick: Span,
        shorter: Span,
        longer: Span,
    },

    #[error("{asked} is more samples than the board counts in one stream")]
    #[diagnostic(help("ask for a shorter --duration, or a longer --period"))]
    TooManySamples { asked: f64 },

    #[error("{asked} is not a rate that this board samples at: at most {highest}")]
    #[diagnostic(help("ask for another --rate; the board samples every whole number of ticks"))]
    Rate {
        asked: Frequency,
        highest: Frequency,
    },

    #[error(
        "a wave of {asked} cannot be played: a cycle takes 100 h at most, and {highest} is the highest"
    )]
    #[diagnostic(help("ask for another --frequency"))]
    Frequency {
        asked: Frequency,
        highest: Frequency,
    },

    #[error(
        "{asked} is no resistor that tells a current sense's gain: 300 to 1000 ohm; nothing was changed"
    )]
    #[diagnostic(help(
        "connect such a resistor to each channel, in the mirror's place, and name its value"
    ))]
    Resistor { asked: Resistance },

    #[error("a board keeps {most} points, and this takes {count}")]
    #[diagnostic(help("ask for fewer steps, or for fewer points"))]
    TooManyPoints { count: usize, most: usize },

    #[error("a dwell of {asked} is not possible: from one control tick, {tick}, to 100 h")]
    #[diagnostic(help("ask for another --dwell or --hold"))]
    Dwell { asked: Span, tick: Span },
}
