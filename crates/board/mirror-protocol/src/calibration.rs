//! What is said of calibrations: uploading one, putting it to use, and which is in use; and of the current sense's.

use crate::Text;
use crate::messages::{Refusal, Sentence};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Bytes of a calibration that travel together.
pub type Chunk = heapless::Vec<u8, 192>;

/// A piece of a calibration in its form as bytes (`control_core::calibration`). One at offset 0 begins
/// an upload, each further one follows the one before it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CalibrationChunk {
    /// Where it belongs.
    pub offset: u16,
    /// The bytes.
    pub bytes: Chunk,
}

/// Ask for a piece of the calibration that was last put to use for good, in the same form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CalibrationQuery {
    /// Where the piece begins; from the end on there is none.
    pub offset: u16,
}

/// For how long the calibration that was uploaded is put to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CalibrationUse {
    /// For good: it is kept through a reset.
    ForGood,
    /// Until a reset, `CalibrationRevertEndpoint` or the next greeting, which bring back the last one that was put to use for good.
    OnTrial,
}

/// What the current sense is off by, channel by channel: what flows is (the designed reading -
/// `zero_a`) x `gain`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Sense {
    /// The designed reading where nothing flows.
    pub zero_a: [f32; 4],
    /// What flows for each ampere that is read beyond that.
    pub gain: [f32; 4],
}

/// The current sense as it is in use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SenseInfo {
    /// What it is taken to be off by.
    pub sense: Sense,
    /// Whether the board keeps that; [`Kept::Factory`]: it was never calibrated.
    pub kept: Kept,
}

/// Whether the board keeps the calibration in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kept {
    /// Yes: it comes up again after a reset or a power cut.
    Yes,
    /// It is the factory's, since none was ever stored.
    Factory,
    /// It is the factory's, since what was stored is bad.
    FactoryAsStoredIsBad,
    /// No: the flash did not take it, and a reset forgets it.
    No,
    /// No: it is on trial ([`CalibrationUse::OnTrial`]).
    OnTrial,
    /// It is the one before the newest, which has rotted.
    Outdated,
}

/// Where an actuator acts on the plate (`control_core::calibration::Lever`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Lever {
    /// Along the x axis, from the plate's centre.
    pub x_um: f32,
    /// Along the y axis.
    pub y_um: f32,
    /// Its part of the warp, in which the actuators move and the plate does not.
    pub warp: f32,
}

/// The calibration in use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct CalibrationInfo {
    /// The mirror it is for.
    pub device: Text,
    /// When it was measured.
    pub date: Text,
    /// Hash of the model that it inverts.
    pub model_hash: u64,
    /// Top of its range.
    pub max_position_um: f32,
    /// Highest drive that it allows.
    pub max_drive_v: f32,
    /// Resistance of each heater at ambient.
    pub cold_resistance_ohm: [f32; 4],
    /// Temperature coefficient of each heater's resistance.
    pub tcr_per_k: [f32; 4],
    /// Of each actuator; all 0 um where nobody knows them.
    pub levers: [Lever; 4],
    /// Whether the board keeps it.
    pub kept: Kept,
}

/// Why an uploaded calibration is not used; the one before stays in use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CalibrationRefusal {
    /// As any command is refused.
    Refused(Refusal),
    /// What is wrong with it, in words.
    Unusable(Sentence),
}
