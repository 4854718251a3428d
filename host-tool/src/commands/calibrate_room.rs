//! `calibrate-room`: what a kelvin of the surroundings is worth to this mirror, from where it stood in one room and where it
//! stands in another.
//!
//! The first time it reads the sensor at a few positions and keeps that in a file; the second time, in another room, it reads
//! them again. The sensor's zero is in both readings, and is gone from their difference.

use std::fmt;
use std::path::{Path, PathBuf};

use calibration::{LEAST_APART_K, RoomPoint, with_ambient_ratio};
use control_core::Calibration;
use control_core::calibration::Parts;
use mirror_protocol::{CalibrationUse, Compensate, Position};
use serde::{Deserialize, Serialize};

use super::calibrate::fall_back;
use super::calibration_file::load_in_use;
use super::measure::interrupt::Interrupt;
use super::measure::sensor::Sensor;
use super::moving::{Pace, read_settled};
use crate::board::Board;
use crate::cli::CalibrateRoom;
use crate::error::{NotImproved, ToolError, UnusableInput};
use crate::names::limit_names;
use crate::new_file::NewFile;
use crate::quantity::{Hold, Span};
use crate::report::{self, decimal};

/// Of the range: where a room 20 K warmer leaves the lowest within reach, and one 20 K colder the highest.
const PARTS_OF_RANGE: [f64; 3] = [0.4, 0.6, 0.8];
/// Two positions tell room and loss apart, so they are gone through once before they are read.
const ROUNDS: usize = 2;
/// By so much a room may be worse than before by the sensor's noise alone (um); what is asked of positions in any room is ten
/// times as much (`docs/requirements.md`).
const NOISE_UM: f64 = 0.05;

/// What the sensor read in one room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RoomReadings {
    /// Of the file.
    format: u32,
    /// The model's hash and the ambient ratio of the calibration that was in use.
    model_hash: String,
    ambient_ratio: f64,
    points: Vec<RoomReading>,
}

/// Of [`RoomReadings`].
const FORMAT: u32 = 1;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RoomReading {
    asked_um: f64,
    /// By the sensor, whose zero may be anywhere.
    read_um: f64,
    /// How much warmer than at calibration the board took the room for (K).
    rise_k: f64,
}

/// What came of it.
#[derive(Serialize)]
#[serde(untagged)]
enum RoomReport {
    First {
        readings: PathBuf,
        points: Vec<RoomReading>,
    },
    Second {
        /// The mean of what the board took the two rooms for.
        rise_then_k: f64,
        rise_now_k: f64,
        asked_um: Vec<f64>,
        /// How far from where it stood in the first room.
        before_um: Vec<f64>,
        after_um: Vec<f64>,
        ratio_before: f64,
        ratio: f64,
        ratio_deviation: f64,
        calibration: Option<PathBuf>,
    },
}

/// Reads the positions, and keeps what was read or compares it with what was kept.
pub(super) async fn run(board: &Board, ask: CalibrateRoom, json: bool) -> Result<(), ToolError> {
    let calibration = load_in_use(board, &ask.calibration).await?;
    let kept = RoomReadings::load(&ask.readings)?;
    if let Some(kept) = &kept
        && !kept.are_under(&calibration)
    {
        return Err(UnusableInput::OtherRoomReadings { file: ask.readings }.into());
    }
    let output = ask.output.map(|path| NewFile::create(path, ask.force));
    let output = output.transpose()?;
    let room = InRoom::open(board, &ask.displacements.sensor, ask.settle).await?;
    let report = match kept {
        None => first(&room, &calibration, &ask.readings).await,
        Some(kept) => second(&room, &calibration, &kept, output).await,
    };
    board.off().await?;
    report::print(&report?, json);
    Ok(())
}

/// Keeps what is read in the first room.
async fn first(
    room: &InRoom<'_>,
    calibration: &Calibration,
    file: &Path,
) -> Result<RoomReport, ToolError> {
    let file = NewFile::create(file.to_owned(), false)?;
    let reach_um = decimal(room.board.status().await?.max_position_um);
    let points = room
        .read(&PARTS_OF_RANGE.map(|part| part * reach_um))
        .await?;
    let readings = RoomReadings::under(calibration, points);
    Ok(RoomReport::First {
        readings: file.write(&readings.to_json())?,
        points: readings.points,
    })
}

/// Finds the ratio, tries it, and keeps the calibration with it where the mirror is nearer to where it was.
async fn second(
    room: &InRoom<'_>,
    calibration: &Calibration,
    kept: &RoomReadings,
    output: Option<NewFile>,
) -> Result<RoomReport, ToolError> {
    let asked_um: Vec<f64> = kept.points.iter().map(|then| then.asked_um).collect();
    let now = room.read(&asked_um).await?;
    let found = with_ambient_ratio(calibration, &compared(&kept.points, &now))?;
    let before_um = off_um(&kept.points, &now);
    let on_trial = room.board.use_calibration(&found, CalibrationUse::OnTrial);
    on_trial.await?;
    let after_um = match nearer(room, kept, &before_um).await {
        Ok(after_um) => after_um,
        Err(error) => return Err(fall_back(room.board, error).await),
    };
    let for_good = room.board.use_calibration(&found, CalibrationUse::ForGood);
    for_good.await?;
    Ok(RoomReport::Second {
        rise_then_k: mean_rise_k(&kept.points),
        rise_now_k: mean_rise_k(&now),
        asked_um,
        before_um,
        after_um,
        ratio_before: decimal(calibration.parts().ambient_ratio),
        ratio: decimal(found.parts().ambient_ratio),
        ratio_deviation: decimal(found.parts().residual.ambient_ratio),
        calibration: output
            .map(|file| file.write(&calibration::to_toml(&found)))
            .transpose()?,
    })
}

/// How far the mirror is from where it stood in the first room, with the calibration that is on trial.
async fn nearer(
    room: &InRoom<'_>,
    kept: &RoomReadings,
    before_um: &[f64],
) -> Result<Vec<f64>, ToolError> {
    let asked_um: Vec<f64> = kept.points.iter().map(|then| then.asked_um).collect();
    let after_um = off_um(&kept.points, &room.read(&asked_um).await?);
    let [before, after] = [before_um, &after_um].map(largest_um);
    if after > before + NOISE_UM {
        return Err(NotImproved::RoomNotBetter {
            before_um: before,
            after_um: after,
        }
        .into());
    }
    Ok(after_um)
}

/// What was asked for in two rooms, as in one: the first room's readings are where the mirror was asked to be.
fn compared(then: &[RoomReading], now: &[RoomReading]) -> Vec<RoomPoint> {
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
fn off_um(then: &[RoomReading], now: &[RoomReading]) -> Vec<f64> {
    let points = compared(then, now);
    points.iter().map(|p| p.reached_um - p.asked_um).collect()
}

fn largest_um(off_um: &[f64]) -> f64 {
    off_um.iter().map(|um| um.abs()).fold(0.0, f64::max)
}

fn mean_rise_k(points: &[RoomReading]) -> f64 {
    points.iter().map(|point| point.rise_k).sum::<f64>() / points.len() as f64
}

/// A board in a room, with a sensor on its mirror.
struct InRoom<'a> {
    board: &'a Board,
    sensor: Sensor,
    pace: Pace,
    interrupt: Interrupt,
}

impl<'a> InRoom<'a> {
    /// Has the board compensate the room, whose ratio is asked for.
    async fn open(board: &'a Board, sensor: &str, settle: Span) -> Result<Self, ToolError> {
        let sensor = Sensor::at_any_time(board, sensor).await?;
        let interrupt = Interrupt::listen()?;
        board.compensate(Compensate { is_wanted: true }).await?;
        Ok(Self {
            board,
            sensor,
            pace: Pace {
                settle,
                hold: Hold::For(Span { s: 1.0 }),
            },
            interrupt,
        })
    }

    /// What the sensor reads at the positions, in their order, from rest on.
    async fn read(&self, positions_um: &[f64]) -> Result<Vec<RoomReading>, ToolError> {
        self.interrupt.or(self.read_all(positions_um)).await
    }

    async fn read_all(&self, positions_um: &[f64]) -> Result<Vec<RoomReading>, ToolError> {
        self.board.off().await?;
        let mut points = Vec::new();
        for _ in 0..ROUNDS {
            points.clear();
            for &asked_um in positions_um {
                points.push(self.read_at(asked_um).await?);
            }
        }
        Ok(points)
    }

    async fn read_at(&self, asked_um: f64) -> Result<RoomReading, ToolError> {
        let lease_ms = self.pace.lease_ms();
        let z_um = asked_um as f32;
        let commanded = self.board.set_position(Position { z_um, lease_ms }).await?;
        let (readings, _) = read_settled(self.board, &commanded, self.pace.settle).await?;
        let serial_um = self.sensor.read_now().await?;
        let status = self.board.status().await?;
        // What held it back on its way is over.
        let limits = limit_names(status.telemetry.limits);
        if let Some(limit) = limits.first() {
            return Err(NotImproved::RoomLimited { asked_um, limit }.into());
        }
        let room = status.telemetry.room.ok_or(NotImproved::RoomUnknown)?;
        Ok(RoomReading {
            asked_um,
            read_um: serial_um
                .or(readings.sensor_z_um)
                .ok_or(ToolError::NoSensor)?,
            rise_k: f64::from(room.rise_ck) / 100.0,
        })
    }
}

impl RoomReadings {
    fn under(calibration: &Calibration, points: Vec<RoomReading>) -> Self {
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
    fn are_under(&self, calibration: &Calibration) -> bool {
        let now = Self::under(calibration, Vec::new());
        (&self.model_hash, self.ambient_ratio) == (&now.model_hash, now.ambient_ratio)
    }

    /// What a file holds; `None` where there is none.
    fn load(file: &Path) -> Result<Option<Self>, ToolError> {
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

    fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain data")
    }
}

impl fmt::Display for RoomReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::First { readings, points } => {
                let rise_k = mean_rise_k(points);
                writeln!(f, "room       {rise_k:+.2} K from that at calibration")?;
                writeln!(f, "readings   {}", readings.display())?;
                writeln!(
                    f,
                    "next       leave sensor and mirror as they are, wait until the room is {LEAST_APART_K} K warmer or colder, \
                     and ask the same again"
                )
            }
            Self::Second {
                rise_then_k,
                rise_now_k,
                asked_um,
                before_um,
                after_um,
                ratio_before,
                ratio,
                ratio_deviation,
                calibration,
            } => {
                writeln!(
                    f,
                    "room       {rise_then_k:+.2} K from that at calibration then, {rise_now_k:+.2} K now"
                )?;
                writeln!(f, "at         {}", line(asked_um))?;
                writeln!(f, "off        {}  before", line(before_um))?;
                writeln!(f, "           {}  now", line(after_um))?;
                writeln!(
                    f,
                    "ratio      {ratio_before:.3} before, {ratio:.3} ± {ratio_deviation:.3} now"
                )?;
                if let Some(file) = calibration {
                    writeln!(f, "written    {}", file.display())?;
                }
                Ok(())
            }
        }
    }
}

/// Lengths as a row of a report.
fn line(um: &[f64]) -> String {
    let um: Vec<String> = um.iter().map(|um| format!("{um:>9.3} um")).collect();
    um.join(" ")
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
