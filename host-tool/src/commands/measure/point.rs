//! Readings that are asked for one at a time, while a person moves something.

use measurement::Row;

use super::header::now;
use super::sensor::Sensor;
use crate::board::Board;
use crate::cli::Instruments;
use crate::commands::moving::read;
use crate::error::ToolError;

/// A board with its instruments, asked point by point.
pub(super) struct Points<'a> {
    board: &'a Board,
    sensor: Sensor,
    ambient_c: Option<f64>,
    /// When time 0 was, and the board's tick then.
    session: String,
    begin_tick: u32,
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
            ambient_c: instruments.ambient_c,
            session: String::new(),
            begin_tick: 0,
        })
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

    /// What the sensor reads now (um), and a row with all else.
    pub(super) async fn read(&self) -> Result<(f64, Row), ToolError> {
        let serial_um = self.sensor.read_now().await?;
        let (readings, tick) = read(self.board).await?;
        let um = serial_um
            .or(readings.sensor_z_um)
            .ok_or(ToolError::NoSensor)?;
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
