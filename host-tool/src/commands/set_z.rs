//! `set-z`: to a position, by the inverse of the model, without a position sensor.

use std::fmt;

use mirror_protocol::Position;
use quantities::Length;
use serde::Serialize;

use crate::board::{Board, check_position};
use crate::commands::moving::{Move, Pace, Readings, note_uncompensated};
use crate::commands::uncertainty::Uncertainty;
use crate::error::ToolError;
use crate::names::{limited_line, limits_of_position};
use crate::report;

#[derive(Serialize)]
struct SetZ {
    asked_um: f64,
    settled_s: f64,
    #[serde(flatten)]
    readings: Readings,
    limited_by: Vec<&'static str>,
    /// How far the mirror may be from what was asked, by what the board knows.
    uncertainty: Uncertainty,
    /// Whether the sensor is a virtual mirror's.
    sensor_is_virtual: bool,
    /// The sensor's reading less what was asked.
    error_um: Option<f64>,
}

pub(super) async fn run(board: &Board, z: Length, pace: Pace, json: bool) -> Result<(), ToolError> {
    let before = board.status().await?;
    check_position(z, &before)?;
    let position = Position {
        z_um: z.um as f32,
        lease_ms: pace.lease_ms(),
    };
    let moving = Move::begin(board, pace, &before)?;
    let commanded = moving.answered(board.set_position(position)).await?;
    let (readings, settled, status) = moving.settle_and_read(&commanded).await?;
    let report = SetZ {
        asked_um: z.um,
        settled_s: settled.s,
        readings,
        limited_by: limits_of_position(&status),
        uncertainty: Uncertainty::of_position(&status.telemetry),
        sensor_is_virtual: board.identity().is_emulated,
        error_um: readings.sensor_z_um.map(|sensor| sensor - z.um),
    };
    report::print(&report, json);
    note_uncompensated(&status);
    report::say(&pace.line(), json);
    Ok(())
}

impl fmt::Display for SetZ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "asked      {:>9.3} um", self.asked_um)?;
        writeln!(f, "uncertain  {}", self.uncertainty)?;
        write!(f, "{}", self.readings)?;
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        if let (Some(sensor), Some(error)) = (self.readings.sensor_z_um, self.error_um) {
            let whose = if self.sensor_is_virtual {
                "virtual sensor"
            } else {
                "sensor"
            };
            writeln!(
                f,
                "moved to   {sensor:>9.3} um by the {whose} after {:.2} s: {error:+.3} um from what was \
                 asked",
                self.settled_s
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Limits;

    #[test]
    fn is_printed_as_in_the_golden_file() {
        let report = SetZ {
            asked_um: 120.0,
            settled_s: 1.0,
            readings: Readings {
                drive_v: [2.742; 4],
                current_a: [5.6961e-3, 5.7902e-3, 5.7748e-3, 5.72e-3],
                temperature_rise_k: [Some(86.04), Some(80.49), None, Some(-0.62)],
                limits: Limits::NONE,
                sensor_z_um: Some(119.6181),
            },
            limited_by: vec!["drive-high"],
            uncertainty: Uncertainty {
                z_um: Some(0.412),
                tilt_deg: None,
                settles_in_s: Some(0.0),
                cools: false,
                once_cooled: None,
                is_away: false,
            },
            sensor_is_virtual: true,
            error_um: Some(-0.3819),
        };
        assert_eq!(
            report.to_string(),
            include_str!("../../tests/golden/set-z.txt")
        );
    }
}
