//! `set-drive`: voltages on the actuators, for measuring what they do.

use std::fmt;

use mirror_protocol::Drives;
use quantities::Voltage;
use serde::Serialize;

use crate::board::{Board, check_drives};
use crate::commands::moving::{Move, Pace, Readings};
use crate::error::{BeyondBoard, ToolError};
use crate::names::{limit_names, limited_line};
use crate::report::{self, row};

#[derive(Serialize)]
struct SetDrive {
    asked_v: [f64; 4],
    #[serde(flatten)]
    readings: Readings,
    limited_by: Vec<&'static str>,
}

/// One voltage means all four actuators.
pub(super) fn for_all_actuators(drives: &[Voltage]) -> Result<[Voltage; 4], ToolError> {
    match *drives {
        [all] => Ok([all; 4]),
        [a, b, c, d] => Ok([a, b, c, d]),
        _ => Err(BeyondBoard::DriveCount {
            count: drives.len(),
        }
        .into()),
    }
}

pub(super) async fn run(
    board: &Board,
    drives: [Voltage; 4],
    pace: Pace,
    json: bool,
) -> Result<(), ToolError> {
    let before = board.status().await?;
    check_drives(drives, &before)?;
    let asked_v = drives.map(|drive| drive.v);
    let drives = Drives {
        drive_v: asked_v.map(|v| v as f32),
        lease_ms: pace.lease_ms(),
    };
    let moving = Move::begin(board, pace, &before)?;
    let commanded = moving.answered(board.set_drive(drives)).await?;
    let (readings, ..) = moving.settle_and_read(&commanded).await?;
    let limited_by = limit_names(commanded.limits);
    report::print(
        &SetDrive {
            asked_v,
            readings,
            limited_by,
        },
        json,
    );
    report::say(&pace.line(), json);
    Ok(())
}

impl fmt::Display for SetDrive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "asked      {}", row(self.asked_v, 3, "V"))?;
        write!(f, "{}", self.readings)?;
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        match self.readings.sensor_z_um {
            Some(z) => writeln!(f, "sensor     {z:>9.3} um"),
            None => Ok(()),
        }
    }
}
