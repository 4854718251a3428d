//! `set-pose`: piston and tilts, by the inverse of the model, without a sensor.

use std::fmt;

use serde::Serialize;

use super::pose::{PlateReport, reach, reached, request};
use crate::board::Board;
use crate::commands::moving::{Move, Pace, Readings, note_uncompensated};
use crate::commands::uncertainty::Uncertainty;
use crate::error::ToolError;
use crate::names::{limited_line, limits_of_position};
use crate::report;
use crate::tilted_pose::TiltedPose;

#[derive(Serialize)]
struct PoseReport {
    asked: TiltedPose,
    /// Where the board has taken the plate, as it counts.
    pose: PlateReport,
    /// How far the plate may be from there, by what the board knows.
    uncertainty: Uncertainty,
    settled_s: f64,
    #[serde(flatten)]
    readings: Readings,
    limited_by: Vec<&'static str>,
}

pub(super) async fn run(
    board: &Board,
    asked: TiltedPose,
    pace: Pace,
    json: bool,
) -> Result<(), ToolError> {
    let before = board.status().await?;
    let reach = reach(board, &before).await?;
    let pose = reached(asked, &reach)?;
    let moving = Move::begin(board, pace, &before)?;
    let commanded = moving
        .answered(board.set_pose(request(pose, pace.lease_ms())))
        .await?;
    let (readings, settled, status) = moving.settle_and_read(&commanded).await?;
    let report = PoseReport {
        asked,
        pose: PlateReport::from(&status.telemetry.pose),
        uncertainty: Uncertainty::of_position(&status.telemetry),
        settled_s: settled.s,
        readings,
        limited_by: limits_of_position(&status),
    };
    report::print(&report, json);
    note_uncompensated(&status);
    report::say(&pace.line(), json);
    Ok(())
}

impl fmt::Display for PoseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "asked      {}", self.asked)?;
        writeln!(f, "pose       {}", self.pose)?;
        writeln!(f, "uncertain  {}", self.uncertainty)?;
        write!(f, "{}", self.readings)?;
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        match self.readings.sensor_z_um {
            Some(z) => writeln!(f, "sensor     {z:>9.3} um"),
            None => Ok(()),
        }
    }
}
