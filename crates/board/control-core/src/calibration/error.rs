//! Why a calibration is not accepted, in terms of the field that is wrong.

use core::fmt;

use super::layout::{BYTES, FORMAT};
use crate::shape::TableError;

/// A number of a calibration, by the name that its file uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what they are")]
pub enum Field {
    Device,
    Date,
    ColdResistance,
    Tcr,
    ThermalResistance,
    LossGrowth,
    SlowerBy,
    Top,
    Knot,
    SensedRise,
    SensedTop,
    FastPole,
    SlowPole,
    SharedPart,
    Play,
    Release,
    Creep,
    Lever,
    MoveTime,
    BeamLag,
    TimeGrowth,
    ResonanceFrequency,
    ResonanceQuality,
    MaxDrive,
    MaxPower,
    MaxRise,
    AmbientRatio,
    SensedCrosstalk,
    Residual,
    Tried,
}

impl Field {
    /// Its name in calibration files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Date => "date",
            Self::ColdResistance => "cold_resistance_ohm",
            Self::Tcr => "tcr_per_k",
            Self::ThermalResistance => "thermal_resistance_k_per_w",
            Self::LossGrowth => "loss_growth_per_k",
            Self::SlowerBy => "slower_by_s",
            Self::Top => "top_um",
            Self::Knot => "temperature_rise_k",
            Self::SensedRise => "sensed_rise_k",
            Self::SensedTop => "sensed_top_k",
            Self::FastPole => "fast_poles",
            Self::SlowPole => "slow_poles",
            Self::SharedPart => "shared",
            Self::Play => "plays",
            Self::Release => "release_s",
            Self::Creep => "creep",
            Self::Lever => "levers",
            Self::MoveTime => "move_time_s",
            Self::BeamLag => "beam_lag_s",
            Self::TimeGrowth => "time_growth_s_per_k",
            Self::ResonanceFrequency => "resonance.frequency_hz",
            Self::ResonanceQuality => "resonance.quality",
            Self::MaxDrive => "max_drive_v",
            Self::MaxPower => "max_power_w",
            Self::MaxRise => "max_rise_k",
            Self::AmbientRatio => "ambient_ratio",
            Self::SensedCrosstalk => "sensed_crosstalk",
            Self::Residual => "residual",
            Self::Tried => "residual.tried_um",
        }
    }

    /// Whether there are several under that name.
    const fn is_list(self) -> bool {
        matches!(
            self,
            Self::Knot
                | Self::SensedRise
                | Self::FastPole
                | Self::SlowPole
                | Self::SharedPart
                | Self::Play
                | Self::Creep
                | Self::Lever
                | Self::Residual
        )
    }
}

/// What is wrong with a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Problem {
    /// It is not finite, or no mirror has such a value.
    OutOfRange,
    /// With the highest rise of temperature that the calibration allows it is none that a mirror can have.
    AtTheHighestRise,
    /// The board's design does not allow it, whatever the mirror (`design.rs`).
    BeyondTheBoard,
    /// They do not tell a plate's two tilts from each other.
    NoPlate,
    /// It does not lie above the one before it.
    NotRising,
    /// It is not that of the first actuator.
    NotTheSame,
    /// The weights do not add up to what they must.
    Sum,
    /// It is not text, or too long.
    NotText,
}

/// Why a calibration is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationError {
    /// There are more or fewer bytes than a calibration has.
    Length {
        /// How many there are.
        bytes: usize,
    },
    /// The bytes do not begin as a calibration does.
    NotACalibration,
    /// It is for another version of the firmware's protocol.
    Format {
        /// The version it is for.
        format: u16,
    },
    /// Its bytes were changed on the way.
    Checksum,
    /// A number of it.
    Number {
        /// Which.
        field: Field,
        /// Of which actuator, from 0.
        actuator: Option<u8>,
        /// Which of several, from 0.
        index: u16,
        /// What is wrong with it.
        problem: Problem,
    },
}

impl CalibrationError {
    pub(super) const fn number(field: Field, index: usize, problem: Problem) -> Self {
        Self::Number {
            field,
            actuator: None,
            index: index as u16,
            problem,
        }
    }

    /// The same, said of an actuator, counted from 0.
    pub fn of_actuator(mut self, of: usize) -> Self {
        if let Self::Number { actuator, .. } = &mut self {
            *actuator = Some(of as u8);
        }
        self
    }
}

impl From<TableError> for CalibrationError {
    fn from(error: TableError) -> Self {
        match error {
            TableError::Range => Self::number(Field::Top, 0, Problem::OutOfRange),
            TableError::Origin => Self::number(Field::Knot, 0, Problem::OutOfRange),
            TableError::NotRising { knot } => Self::number(Field::Knot, knot, Problem::NotRising),
        }
    }
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length { bytes } => write!(f, "it has {bytes} bytes, not {BYTES}"),
            Self::NotACalibration => f.write_str("it does not begin as a calibration does"),
            Self::Format { format } => write!(f, "it is of format {format}, not {FORMAT}"),
            Self::Checksum => f.write_str("its checksum is wrong: it was damaged on the way"),
            Self::Number {
                field,
                actuator,
                index,
                problem,
            } => {
                f.write_str(field.name())?;
                if field.is_list() {
                    write!(f, "[{index}]")?;
                }
                if let Some(actuator) = actuator {
                    write!(f, " of actuator {}", actuator + 1)?;
                }
                f.write_str(match problem {
                    Problem::OutOfRange => " is not a value that a mirror can have",
                    Problem::AtTheHighestRise => {
                        " and max_rise_k are not values that a mirror can have together"
                    }
                    Problem::BeyondTheBoard => " is beyond the limits of this board",
                    Problem::NoPlate => {
                        " and those with it do not tell the plate's tilts from each other"
                    }
                    Problem::NotRising => " does not rise above the one before it",
                    Problem::NotTheSame => " is not that of the first actuator",
                    Problem::Sum => " and those with it do not add up",
                    Problem::NotText => " is not text that fits",
                })
            }
        }
    }
}

impl core::error::Error for CalibrationError {}
