//! `status`: who the board is and what it is doing. `clear`: the same once its faults are forgotten.

use std::fmt;

use mirror_protocol::{CalibrationInfo, Identity, Kept, LEASE_FOREVER_MS, Status};
use serde::Serialize;

use crate::board::Board;
use crate::commands::moving::{Readings, limit_names, limited_line, state_name};
use crate::error::ToolError;
use crate::report::{self, decimal};

#[derive(Serialize)]
struct StatusReport {
    identity: Identity,
    calibration: CalibrationInfo,
    up_s: f64,
    #[serde(flatten)]
    readings: Readings,
    limited_by: Vec<&'static str>,
    /// What each channel is doing.
    states: [String; 4],
    /// What is left of the lease of what is driven, if anything is.
    lease: Option<LeaseLeft>,
    supply_v: f64,
    max_position_um: f64,
    max_drive_v: f64,
    missed_ticks: u32,
    /// What the firmware said when it stopped before this start.
    last_stop: String,
    dropped_samples: u32,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum LeaseLeft {
    Seconds(f64),
    Forever,
}

/// Lets the board forget its faults, and shows what it does then.
pub(super) async fn clear(board: &Board, json: bool) -> Result<(), ToolError> {
    board.clear().await?;
    run(board, json).await
}

pub(super) async fn run(board: &Board, json: bool) -> Result<(), ToolError> {
    let status = board.status().await?;
    let calibration = board.calibration().await?;
    let report = StatusReport::new(board.identity().clone(), calibration, &status);
    report::print(&report, json);
    Ok(())
}

impl StatusReport {
    /// One word where all channels do the same.
    fn channels(&self) -> String {
        if self.states.iter().all(|state| *state == self.states[0]) {
            format!("all {}", self.states[0])
        } else {
            self.states.join(", ")
        }
    }

    fn new(identity: Identity, calibration: CalibrationInfo, status: &Status) -> Self {
        Self {
            up_s: f64::from(status.telemetry.tick) / f64::from(identity.tick_hz),
            identity,
            calibration,
            readings: Readings::mean(&[status.telemetry]),
            limited_by: limit_names(status.telemetry.limits),
            states: status.telemetry.states.map(state_name),
            lease: status.health.lease_left_ms.map(|ms| match ms {
                LEASE_FOREVER_MS => LeaseLeft::Forever,
                ms => LeaseLeft::Seconds(f64::from(ms) * 1e-3),
            }),
            supply_v: decimal(status.health.supply_v),
            missed_ticks: status.health.missed_ticks,
            last_stop: status.last_stop.as_str().to_owned(),
            max_position_um: decimal(status.max_position_um),
            max_drive_v: decimal(status.max_drive_v),
            dropped_samples: status.dropped_samples,
        }
    }
}

impl fmt::Display for StatusReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let identity = &self.identity;
        writeln!(f, "board      {}", identity.board)?;
        writeln!(
            f,
            "firmware   {} ({}), protocol {}, {} control ticks/s",
            identity.firmware_version, identity.build, identity.protocol_version, identity.tick_hz
        )?;
        writeln!(f, "up         {:.1} s", self.up_s)?;
        let CalibrationInfo { device, date, .. } = &self.calibration;
        let kept = kept_words(self.calibration.kept);
        // The factory's is of no device, and of no day.
        let mut words = vec![device.as_str(), date.as_str(), kept];
        words.retain(|word| !word.is_empty());
        writeln!(f, "calibrated {}", words.join(", "))?;
        writeln!(
            f,
            "range      0 to {:.1} um, 0 to {:.2} V",
            self.max_position_um, self.max_drive_v
        )?;
        writeln!(f, "supply     {:.2} V", self.supply_v)?;
        writeln!(f, "channels   {}", self.channels())?;
        write!(f, "{}", self.readings)?;
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        match self.lease {
            Some(LeaseLeft::Seconds(left)) => {
                writeln!(f, "held for   {left:.1} s more, then ramped to zero")?;
            }
            Some(LeaseLeft::Forever) => writeln!(f, "held       until told otherwise")?,
            None => {}
        }
        if !self.last_stop.is_empty() {
            writeln!(f, "stopped    before this start: {}", self.last_stop)?;
        }
        if self.missed_ticks > 0 {
            writeln!(
                f,
                "missed     {} control ticks since start",
                self.missed_ticks
            )?;
        }
        if self.dropped_samples > 0 {
            writeln!(f, "dropped    {} samples since start", self.dropped_samples)?;
        }
        Ok(())
    }
}

fn kept_words(kept: Kept) -> &'static str {
    match kept {
        Kept::Yes => "kept in flash",
        Kept::Factory => "as the factory left it",
        Kept::FactoryAsStoredIsBad => {
            "the factory's, since the stored one is bad: calibrate the board again"
        }
        Kept::No => "not kept: a reset forgets it; its flash did not take it",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_protocol::{ChannelState, Health, Sentence, Telemetry, Text};

    #[test]
    fn is_printed_as_in_the_golden_file() {
        let text = |text| Text::try_from(text).expect("short");
        let identity = Identity {
            protocol_version: 1,
            firmware_version: text("0.1.0"),
            build: text("a396533"),
            board: text("STM32G474RE driver board"),
            is_emulated: false,
            tick_hz: 10_000,
        };
        let calibration = CalibrationInfo {
            device: text("mirror 7"),
            date: text("2026-11-21"),
            model_hash: 7,
            max_position_um: 173.7,
            max_drive_v: 3.5,
            kept: Kept::Yes,
        };
        let status = Status {
            telemetry: Telemetry {
                tick: 123_456,
                drive_v: [1.9, 0.2, 0.0, 0.2],
                current_a: [4.43e-3, 0.554e-3, 0.0, 0.549e-3],
                temperature_k: [Some(48.8), Some(0.7), None, Some(3.0)],
                limits: 0,
                states: [
                    ChannelState::Driving,
                    ChannelState::Driving,
                    ChannelState::Tripped(1),
                    ChannelState::Driving,
                ],
                sensor_z_um: None,
            },
            health: Health {
                lease_left_ms: Some(598_765),
                supply_v: 5.004,
                missed_ticks: 2,
                limits_since_command: 0,
            },
            max_position_um: 173.7,
            max_drive_v: 3.5,
            dropped_samples: 7,
            last_stop: Sentence::try_from("panicked at src/control.rs:1:1").expect("short"),
        };
        assert_eq!(
            StatusReport::new(identity, calibration, &status).to_string(),
            include_str!("../../tests/golden/status.txt")
        );
    }
}
