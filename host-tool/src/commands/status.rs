//! `status`: who the board is and what it is doing.

use std::fmt;

use mirror_protocol::{Identity, Status};
use serde::Serialize;

use crate::board::Board;
use crate::commands::moving::{Readings, limit_names};
use crate::error::ToolError;
use crate::report;

#[derive(Serialize)]
struct StatusReport {
    identity: Identity,
    up_s: f64,
    #[serde(flatten)]
    readings: Readings,
    limited_by: Vec<&'static str>,
    max_position_um: f64,
    max_drive_v: f64,
    dropped_samples: u32,
}

pub(super) async fn run(board: &Board, json: bool) -> Result<(), ToolError> {
    let status = board.status().await?;
    report::print(&StatusReport::new(board.identity().clone(), &status), json);
    Ok(())
}

impl StatusReport {
    fn new(identity: Identity, status: &Status) -> Self {
        Self {
            up_s: f64::from(status.telemetry.tick) / f64::from(identity.tick_hz),
            identity,
            readings: Readings::mean(&[status.telemetry]),
            limited_by: limit_names(status.telemetry.limits),
            max_position_um: status.max_position_um.into(),
            max_drive_v: status.max_drive_v.into(),
            dropped_samples: status.dropped_samples,
        }
    }
}

impl fmt::Display for StatusReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let identity = &self.identity;
        writeln!(f, "board      {}", identity.board.name())?;
        writeln!(
            f,
            "firmware   {} ({}), protocol {}, {} control ticks/s",
            identity.firmware_version, identity.build, identity.protocol_version, identity.tick_hz
        )?;
        writeln!(f, "up         {:.1} s", self.up_s)?;
        writeln!(
            f,
            "range      0 to {:.1} um, 0 to {:.2} V",
            self.max_position_um, self.max_drive_v
        )?;
        write!(f, "{}", self.readings)?;
        if self.dropped_samples > 0 {
            writeln!(f, "dropped    {} samples since start", self.dropped_samples)?;
        }
        Ok(())
    }
}
