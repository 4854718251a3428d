//! Readings that are asked for one at a time, while a person moves something.

use measurement::Row;

use mirror_protocol::{Commanded, Drives};
use quantities::{Span, Voltage};

use super::header::now;
use super::rested::Rested;
use super::run::LEASE_MS;
use super::sensor::Sensor;
use crate::board::Board;
use crate::cli::Instruments;
use crate::commands::moving::{check_lease, read};
use crate::error::{SensorFault, ToolError};

/// Drives are whole counts of the board's PWM, a millivolt each (`control_core`, `codes.rs`).
const COUNT_V: f64 = 1e-3;

/// A board with its instruments, asked point by point.
pub(super) struct Points<'a> {
    board: &'a Board,
    sensor: Sensor,
    /// How late it tells what it reads.
    sensor_lag: Span,
    ambient_c: Option<f64>,
    /// When time 0 was, and the board's tick then.
    session: String,
    begin_tick: u32,
    /// What all actuators are to be driven by (V).
    asked_v: f64,
}

impl<'a> Points<'a> {
    /// The instruments that a user names, where they can answer at any time.
    pub(super) async fn open(
        board: &'a Board,
        instruments: &Instruments,
    ) -> Result<Self, ToolError> {
        Ok(Self {
            board,
            sensor: Sensor::at_any_time(board, &instruments.sensor).await?,
            sensor_lag: instruments.sensor_lag,
            ambient_c: instruments.ambient_c,
            session: String::new(),
            begin_tick: 0,
            asked_v: 0.0,
        })
    }

    /// Turns all channels off and lets the mirror come to rest.
    pub(super) async fn come_to_rest(&self) -> Result<Rested, ToolError> {
        Rested::wait_for(self.board, &self.sensor).await
    }

    /// Time 0, with all channels off.
    pub(super) async fn begin(self) -> Result<Self, ToolError> {
        let begin_tick = self.board.off().await?.tick;
        Ok(Self {
            session: now(),
            begin_tick,
            ..self
        })
    }

    /// When time 0 was.
    pub(super) fn session(&self) -> &str {
        &self.session
    }

    /// Drives all actuators, for as long as the lease is renewed.
    pub(super) async fn drive(&mut self, asked: Voltage) -> Result<Commanded, ToolError> {
        self.asked_v = asked.v;
        let drives = Drives {
            drive_v: [asked.v as f32; 4],
            lease_ms: LEASE_MS,
        };
        self.board.set_drive(drives).await
    }

    /// What the sensor reads now (um), and a row with all else. Where the board does not drive what was asked for, that is no reading.
    pub(super) async fn read(&self) -> Result<(f64, Row), ToolError> {
        if self.sensor_lag.s > 0.0 {
            let now = self.board.status().await?.telemetry.tick;
            self.board.wait(now, self.sensor_lag).await?;
        }
        let serial_um = self.sensor.read_now().await?;
        let (readings, tick) = read(self.board).await?;
        check_lease(readings.limits)?;
        check_drives(readings.drive_v, self.asked_v)?;
        let um = serial_um
            .or(readings.sensor_z_um)
            .ok_or(SensorFault::NoSensor)?;
        let t_s = self.board.span(self.begin_tick, tick).s;
        let row = Row {
            t_s,
            t_global_s: Some(t_s),
            voltage_v: readings.drive_v,
            current_a: readings.current_a.map(Some),
            ambient_c: self.ambient_c,
            ..Row::default()
        };
        Ok((um, row))
    }
}

/// Whether all actuators have what was asked for.
fn check_drives(drive_v: [f64; 4], asked_v: f64) -> Result<(), ToolError> {
    let mut drives = (1..).zip(drive_v);
    match drives.find(|(_, drive_v)| (drive_v - asked_v).abs() > COUNT_V) {
        None => Ok(()),
        Some((actuator, drive_v)) => Err(SensorFault::DrivenOtherwise {
            found: format!("actuator {actuator} has {drive_v:.3} V in place of {asked_v:.3} V"),
        }
        .into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_that_is_driven_otherwise_is_told() {
        assert!(check_drives([1.9996, 2.0, 2.0, 2.0004], 2.0).is_ok());
        let said = check_drives([2.0, 2.0, 0.0, 2.0], 2.0).expect_err("told");
        let said = said.to_string();
        assert!(
            said.contains("actuator 3 has 0.000 V in place of 2.000 V"),
            "{said}"
        );
    }
}
