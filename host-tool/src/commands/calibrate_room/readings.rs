//! What a sensor read in a room, as a file, and what it read in two.

use std::path::Path;

use calibration::{RoomPoint, further_um};
use control_core::Calibration;
use control_core::calibration::Parts;
use serde::{Deserialize, Serialize};

use crate::error::{ToolError, UnusableInput};
use crate::report::decimal;

/// What the sensor read in one room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RoomReadings {
    /// Of the file.
    format: u32,
    /// The model's hash and the ambient ratio of the calibration that was in use.
    model_hash: String,
    ambient_ratio: f64,
    pub(super) points: Vec<RoomReading>,
}

/// In any room a position may be off by so much (um; `docs/requirements.md`). A ratio that leaves more is not what has moved the mirror.
pub(super) const ANY_ROOM_UM: f64 = 0.5;

/// Of [`RoomReadings`].
const FORMAT: u32 = 1;

/// At one position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RoomReading {
    /// Where the mirror was asked to be (um).
    pub(super) asked_um: f64,
    /// By the sensor, whose zero may be anywhere (um).
    pub(super) read_um: f64,
    /// How much warmer than at calibration the board took the room for (K).
    pub(super) rise_k: f64,
}

impl RoomReadings {
    /// Of this calibration.
    pub(super) fn under(calibration: &Calibration, points: Vec<RoomReading>) -> Self {
        let Parts {
            origin,
            ambient_ratio,
            ..
        } = calibration.parts();
        Self {
            format: FORMAT,
            model_hash: format!("{:016x}", origin.model_hash),
            ambient_ratio: decimal(*ambient_ratio),
            points,
        }
    }

    /// Whether they were read under this calibration.
    pub(super) fn are_under(&self, calibration: &Calibration) -> bool {
        let now = Self::under(calibration, Vec::new());
        (&self.model_hash, self.ambient_ratio) == (&now.model_hash, now.ambient_ratio)
    }

    /// What the sensor would have read there under `found`, which has another ratio than the calibration that was in use.
    pub(super) fn read_under(
        &self,
        calibration: &Calibration,
        found: &Calibration,
    ) -> Vec<RoomReading> {
        let read = |then: &RoomReading| RoomReading {
            read_um: then.read_um + further_um((calibration, found), then.asked_um, then.rise_k),
            ..*then
        };
        self.points.iter().map(read).collect()
    }

    /// What a file holds; `None` where there is none.
    pub(super) fn load(file: &Path) -> Result<Option<Self>, ToolError> {
        if !file.exists() {
            return Ok(None);
        }
        let text = input_file::read_text(file, input_file::MOST_WRITTEN)?;
        let bad = |reason: String| {
            ToolError::from(UnusableInput::RoomReadings {
                file: file.to_owned(),
                reason,
            })
        };
        let read: Self = serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?;
        if read.format != FORMAT {
            return Err(bad(format!("it has format {}, not {FORMAT}", read.format)));
        }
        if read.points.is_empty() {
            return Err(bad("it has no readings".into()));
        }
        Ok(Some(read))
    }

    /// As a file.
    pub(super) fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain data")
    }
}

/// What was asked for in two rooms, as in one: the first room's readings are where the mirror was asked to be.
pub(super) fn compared(then: &[RoomReading], now: &[RoomReading]) -> Vec<RoomPoint> {
    let pairs = then.iter().zip(now);
    pairs
        .map(|(then, now)| RoomPoint {
            asked_um: then.asked_um,
            reached_um: then.asked_um + now.read_um - then.read_um,
            rise_k: now.rise_k - then.rise_k,
        })
        .collect()
}

/// How far the mirror is from where it stood in the first room, at each position.
pub(super) fn off_um(then: &[RoomReading], now: &[RoomReading]) -> Vec<f64> {
    let points = compared(then, now);
    points.iter().map(|p| p.reached_um - p.asked_um).collect()
}

pub(super) fn largest_um(off_um: &[f64]) -> f64 {
    off_um.iter().map(|um| um.abs()).fold(0.0, f64::max)
}

pub(super) fn mean_rise_k(points: &[RoomReading]) -> f64 {
    points.iter().map(|point| point.rise_k).sum::<f64>() / points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn at(asked_um: f64, read_um: f64, rise_k: f64) -> RoomReading {
        RoomReading {
            asked_um,
            read_um,
            rise_k,
        }
    }

    #[test]
    fn a_sensor_s_zero_is_gone_from_what_two_rooms_differ_by() {
        let then = [at(60.0, 1060.1, 0.5), at(120.0, 1120.0, 0.5)];
        let now = [at(60.0, 1060.6, 10.5), at(120.0, 1119.0, 10.5)];
        let expected = [(60.0, 0.5), (120.0, -1.0)];
        for (point, (asked_um, off_um)) in compared(&then, &now).iter().zip(expected) {
            assert_eq!((point.asked_um, point.rise_k), (asked_um, 10.0));
            // Rounding of numbers of a thousand.
            assert!((point.reached_um - asked_um - off_um).abs() < 1e-9);
        }
        assert!((largest_um(&off_um(&then, &now)) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn readings_are_kept_as_they_are_and_rubbish_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("room.json");
        assert_eq!(RoomReadings::load(&file).expect("none yet"), None);
        let readings = RoomReadings {
            format: FORMAT,
            model_hash: "00000000000000ab".into(),
            ambient_ratio: 1.02,
            points: vec![at(60.0, -3.25, 0.01)],
        };
        let text = readings.to_json();
        fs::write(&file, &text).expect("written");
        assert_eq!(RoomReadings::load(&file).expect("whole"), Some(readings));
        let half = text.len() / 2;
        for (from, to, said) in [
            ("\"format\": 1", "\"format\": 2", "it has format 2, not 1"),
            ("0.01", "null", "invalid type: null"),
            ("rise_k", "rise", "unknown field `rise`"),
            ("\"format\": 1,", "", "missing field `format`"),
            (&text[half..], "", "EOF"),
            (
                &text[text.find('{').expect("an object")..],
                "{}",
                "missing field",
            ),
        ] {
            fs::write(&file, text.replace(from, to)).expect("written");
            let error = RoomReadings::load(&file).expect_err("rubbish").to_string();
            assert!(error.contains(said), "`{said}` is not in: {error}");
        }
    }
}
