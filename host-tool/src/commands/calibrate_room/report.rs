//! What `calibrate-room` says at its end.

use std::fmt;
use std::path::PathBuf;

use calibration::LEAST_APART_K;
use serde::Serialize;

use super::readings::{ANY_ROOM_UM, RoomReading, mean_rise_k};
use crate::commands::following::mean_and_rms;

/// What came of it.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum RoomReport {
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
                match mean_and_rms(before_um.iter().copied()).0 {
                    um if um.abs() > ANY_ROOM_UM => writeln!(
                        f,
                        "beware     a sensor that has moved by {um:+.2} um between the rooms looks the same: back in the first one, see whether it \
                         reads as before, by `host-tool set-z {:.0}um`",
                        asked_um.first().copied().unwrap_or(0.0)
                    ),
                    _ => Ok(()),
                }
            }
        }
    }
}

/// Lengths as a row of a report.
fn line(um: &[f64]) -> String {
    let um: Vec<String> = um.iter().map(|um| format!("{um:>9.3} um")).collect();
    um.join(" ")
}
