//! `room`: what the heaters' resistances tell of the surroundings, and whether positions are compensated for them.

use std::fmt;

use mirror_protocol::{Compensate, Status};
use serde::Serialize;

use crate::board::{Board, View};
use crate::cli::Switch;
use crate::error::ToolError;
use crate::report::{self, decimal};

/// What a board knows of its surroundings, against those at calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Room {
    /// How much warmer they are, and its standard deviation.
    rise_k: f64,
    deviation_k: f64,
    /// How much more of the heat they take, as a part of it, and its standard deviation.
    loss: f64,
    loss_deviation: f64,
    /// Whether positions are compensated for them.
    is_compensated: bool,
}

#[derive(Serialize)]
struct SurroundingsReport {
    /// `None` where the calibration in use does not know the resistances well enough.
    room: Option<Room>,
}

/// Switches whether positions are compensated, and shows the room.
pub(super) async fn switch(board: &Board, switch: Switch, json: bool) -> Result<(), ToolError> {
    let is_wanted = switch == Switch::On;
    board.compensate(Compensate { is_wanted }).await?;
    show(board, json).await
}

/// Shows the room.
pub(super) async fn show(board: &View, json: bool) -> Result<(), ToolError> {
    let room = Room::of(&board.status().await?);
    report::print(&SurroundingsReport { room }, json);
    Ok(())
}

impl Room {
    /// How well its temperature is known (K).
    pub(super) fn deviation_k(&self) -> f64 {
        self.deviation_k
    }

    /// What a status tells.
    pub(super) fn of(status: &Status) -> Option<Self> {
        let (room, loss) = (status.telemetry.room?, status.health.loss?);
        Some(Self {
            rise_k: f64::from(room.rise_ck) / 100.0,
            deviation_k: f64::from(room.deviation_ck) / 100.0,
            loss: decimal(loss.change),
            loss_deviation: decimal(loss.deviation),
            is_compensated: status.health.compensates_room,
        })
    }
}

/// As the line of a report.
pub(super) fn line(room: Option<&Room>) -> String {
    room.map_or_else(
        || "unknown: the calibration in use does not tell it; `host-tool calibrate` measures it, or says why it cannot".to_owned(),
        Room::to_string,
    )
}

impl fmt::Display for Room {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let than = if self.rise_k < 0.0 {
            "colder"
        } else {
            "warmer"
        };
        let not = if self.is_compensated { "" } else { " not" };
        write!(
            f,
            "{:.2} ± {:.2} K {than} than at calibration, loss {:+.1} ± {:.1} %;{not} compensated",
            self.rise_k.abs(),
            self.deviation_k,
            100.0 * self.loss,
            100.0 * self.loss_deviation,
        )
    }
}

impl fmt::Display for SurroundingsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "room       {}", line(self.room.as_ref()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_told_with_how_well_it_is_known() {
        let warm = Room {
            rise_k: 10.2,
            deviation_k: 0.05,
            loss: -0.012,
            loss_deviation: 0.002,
            is_compensated: true,
        };
        let told = "10.20 ± 0.05 K warmer than at calibration, loss -1.2 ± 0.2 %; compensated";
        assert_eq!(line(Some(&warm)), told);
        let left = Room {
            rise_k: -3.0,
            is_compensated: false,
            ..warm
        };
        let told = "3.00 ± 0.05 K colder than at calibration, loss -1.2 ± 0.2 %; not compensated";
        assert_eq!(line(Some(&left)), told);
        assert!(line(None).contains("`host-tool calibrate`"));
    }
}
