//! A piece of an experiment on the board: what it plays, and the rows that its samples make.

use control_core::Limits;
use experiment_player::{Clock, Piece, decimal, rows};
use measurement::{MeasurementFile, Row};
use mirror_protocol::{Play, Telemetry};

use super::{Bench, LEASE_MS};
use crate::commands::measure::sensor::Sensor;
use crate::commands::moving::check_lease;
use crate::error::ToolError;

impl Bench<'_> {
    /// Plays a piece after what was held since a tick, and appends its rows.
    pub(super) async fn play(
        &mut self,
        piece: &Piece,
        passed_s: f64,
        prehold: Option<(f64, u32)>,
        file: &mut MeasurementFile,
    ) -> Result<(), ToolError> {
        let mut play = Play {
            waveform: piece.waveform,
            stream: piece.stream,
            lease_ms: LEASE_MS,
        };
        let is_board = matches!(self.sensor, Sensor::Board);
        let tick_hz = self.tick_hz();
        let listening = match is_board {
            true => self.lag.listening(piece, tick_hz),
            false => None,
        };
        play.stream.count += listening.map_or(0, |listening| listening.samples);
        self.sensor.begin();
        let (mut stream, first_tick) = self.board.play(&play).await?;
        if let Some((volts, since)) = prehold {
            file.keys.set("prehold_V", &volts.to_string());
            let held = self.board.span(since, first_tick);
            file.keys.set("prehold_s", &held.s.to_string());
        }
        self.journal.begin(&file.keys, &self.like())?;
        let clock = Clock {
            tick_hz,
            session_tick: self.session_tick,
            first_tick,
            passed_s,
        };
        let mut last: Option<Telemetry> = None;
        while let Some(sample) = stream.next_of_all().await? {
            check_lease(Limits::from_bits(sample.limits))?;
            let played = i64::from(sample.tick.wrapping_sub(first_tick) as i32);
            if let Some(listening) = listening.filter(|listening| listening.is_after(played)) {
                let at_s = self.board.span(self.session_tick, sample.tick).s;
                self.lag.hear(at_s, sample.sensor_z_um.map(decimal));
                if listening.is_over(played) {
                    break;
                }
                continue;
            }
            if let Some(last) = last {
                for mut row in rows(&[last, sample], piece, &clock) {
                    row.ambient_c = self.ambient_c;
                    // Another sensor's readings come once the experiment is over, and no others take their place.
                    row.z_um = row.z_um.filter(|_| is_board);
                    file.rows.push(row);
                    self.zero.look_at(&row);
                    self.journal.append(row, self.zero.um)?;
                    self.limits.push(Limits::from_bits(last.limits));
                }
            }
            last = Some(sample);
            self.reach(sample.tick);
        }
        Ok(())
    }

    /// A row with everything that is in one before the experiment is over.
    fn like(&self) -> Row {
        Row {
            t_global_s: Some(0.0),
            current_a: [Some(0.0); 4],
            z_um: matches!(self.sensor, Sensor::Board).then_some(0.0),
            ambient_c: self.ambient_c,
            ..Row::default()
        }
    }
}
