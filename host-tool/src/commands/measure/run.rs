//! Measures experiments on a board: rest, prehold, waveforms; samples into files.

mod at_rest;
mod playing;

use std::thread;

use control_core::Limits;
use experiment_player::{Piece, pieces};
use experiments::{Experiment, Prehold};
use measurement::MeasurementFile;
use mirror_protocol::{Drives, Status};
use quantities::Span;
use tokio::sync::oneshot;

use super::header::{header, now};
use super::journal::Journal;
use super::lag::Lag;
use super::progress::Progress;
use super::readings::Impossible;
use super::report::MeasuredFile;
use super::rest::Zero;
use super::rested::sensor_um;
use super::sensor::{Sensor, impossible_words};
use crate::board::{Board, RENEWED_LEASE_MS};
use crate::commands::interrupt::Interrupt;
use crate::error::{OutputError, ToolError};
use crate::new_file::NewFile;
use crate::working::spinner;

/// A board left alone while it measures ramps to zero after this.
pub(super) const LEASE_MS: u32 = RENEWED_LEASE_MS;

/// A board with its instruments, for as long as a session lasts.
pub(crate) struct Bench<'a> {
    board: &'a Board,
    sensor: Sensor,
    lag: Lag,
    ambient_c: Option<f64>,
    session: String,
    session_tick: u32,
    /// The tick in which the present experiment began.
    started_tick: u32,
    /// Where the board's own sensor stood when the session first read it at rest.
    zero: Zero,
    progress: Progress,
    quiet: bool,
    interrupt: Interrupt,
    /// What acted in the tick of every row so far.
    limits: Vec<Limits>,
    journal: Journal,
}

/// A measurement, and how it ended.
pub(crate) struct Measured {
    pub(crate) file: MeasurementFile,
    /// What acted in the tick of every row.
    pub(crate) limits: Vec<Limits>,
    /// Numbers of the sensor that are none of its readings.
    pub(crate) impossible: Impossible,
    pub(crate) ended: Result<Ended, ToolError>,
}

/// How a measurement ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    Complete,
    /// By Ctrl-C; channels are off.
    Interrupted,
}

/// Works on a driven board: it is told to go on for as long as the work takes, and Ctrl-C ends the work.
pub(super) async fn attended(
    board: &Board,
    interrupt: &Interrupt,
    work: impl Future<Output = Result<(), ToolError>>,
) -> Result<Ended, ToolError> {
    tokio::select! {
        done = work => done.map(|()| Ended::Complete),
        Err(error) = board.keep_renewing() => Err(error),
        () = interrupt.comes() => Ok(Ended::Interrupted),
    }
}

/// What a command comes to whose measurement ended so: what was interrupted has not done what was asked.
pub(crate) fn whole(ended: Result<Ended, ToolError>) -> Result<(), ToolError> {
    match ended? {
        Ended::Complete => Ok(()),
        Ended::Interrupted => Err(ToolError::Interrupted),
    }
}

/// Why a measurement is not whole, for its file.
pub(crate) fn partial(ended: &Result<Ended, ToolError>) -> Option<String> {
    match ended {
        Ok(Ended::Complete) => None,
        Ok(Ended::Interrupted) => Some("interrupted".to_owned()),
        Err(error) => Some(error.to_string()),
    }
}

/// The noise of a row's displacement, one standard deviation (um).
fn set_noise(file: &mut MeasurementFile, noise_um: f64) {
    file.keys
        .set("noise_z_nm", &format!("{:.2}", 1e3 * noise_um));
}

impl<'a> Bench<'a> {
    /// Begins a session, with all channels off.
    pub(crate) async fn open(
        board: &'a Board,
        sensor: Sensor,
        ambient_c: Option<f64>,
        quiet: bool,
    ) -> Result<Self, ToolError> {
        let off = board.off().await?;
        Ok(Self {
            board,
            sensor,
            lag: Lag::of(Span { s: 0.0 }),
            ambient_c,
            session: now(),
            session_tick: off.tick,
            started_tick: off.tick,
            zero: Zero::default(),
            progress: Progress::new(quiet),
            quiet,
            interrupt: Interrupt::listen()?,
            limits: Vec::new(),
            journal: Journal::default(),
        })
    }

    /// With a sensor that tells so late what it reads.
    pub(crate) fn with_sensor_lag(self, sensor_lag: Span) -> Self {
        Self {
            lag: Lag::of(sensor_lag),
            ..self
        }
    }

    /// How far from its rest the mirror was, by what the board knows of earlier drives, where displacements count from (um); `None` where they
    /// count from the sensor's own zero.
    pub(crate) fn counts_from_um(&self) -> Option<f64> {
        self.zero.um.map(|_| self.zero.remembered_um)
    }

    /// These experiments are to come, and none between them: how much is left is told for all of them.
    pub(crate) fn plan(&mut self, experiments: &[Experiment]) {
        self.progress.plan(experiments);
    }

    /// Measures one experiment, and writes `file` as its rows come. Where there are rows it is whole in the end, or the
    /// error says what it holds.
    pub(super) async fn measure_into(
        &mut self,
        experiment: &Experiment,
        file: NewFile,
    ) -> (Option<MeasuredFile>, Result<Ended, ToolError>) {
        self.journal = Journal::new(file);
        let Measured { file, ended, .. } = self.measure(experiment).await;
        let recording = std::mem::take(&mut self.journal).into_recording();
        let rows = file.rows.len();
        let unread = file.rows.iter().filter(|row| row.z_um.is_none()).count();
        // A board whose sensor has never read anything has none: currents alone were measured.
        let has_sensor = !matches!(self.sensor, Sensor::Board) || self.zero.um.is_some();
        let without_displacement = if has_sensor { unread } else { 0 };
        match (recording, ended) {
            (Some(_), Err(error @ ToolError::Output(OutputError::CutShort { .. }))) => {
                (None, Err(error))
            }
            // A file without rows would be no measurement.
            (Some(recording), ended) if rows == 0 => {
                (None, recording.discard().map_err(Into::into).and(ended))
            }
            (Some(recording), ended) => match recording.replace(&file.to_string()) {
                Ok(file) => {
                    let measured = MeasuredFile {
                        file,
                        rows,
                        without_displacement,
                    };
                    (Some(measured), ended)
                }
                Err(error) => (None, Err(error.into())),
            },
            (None, ended) => (None, ended),
        }
    }

    /// Measures one experiment. What was measured is kept whatever happens, and the channels are off
    /// afterwards.
    pub(crate) async fn measure(&mut self, experiment: &Experiment) -> Measured {
        let mut file = self.header(experiment);
        let pieces = match pieces(experiment, self.tick_hz()) {
            Ok(pieces) => pieces,
            Err(error) => {
                return Measured {
                    file,
                    limits: Vec::new(),
                    impossible: Impossible::NONE,
                    ended: Err(error.into()),
                };
            }
        };
        self.progress.begin(experiment);
        self.limits.clear();
        let board = self.board;
        let interrupt = self.interrupt.clone();
        let ended = attended(
            board,
            &interrupt,
            self.perform(experiment, &pieces, &mut file),
        )
        .await;
        if let Some(partial) = partial(&ended) {
            file.keys.set("partial", &partial);
        }
        // Nothing more to lose: a board that does not answer has been told of by now.
        let off = self.board.off().await.map(drop);
        let off = off.and(self.board.stop_stream().await);
        let read = self.sensor.read_into(self.lag.span, &mut file);
        match &read {
            Ok(Impossible {
                numbers: numbers @ 1..,
                ..
            }) => self.progress.warn(&impossible_words(*numbers)),
            Err(error) if ended.is_ok() => file.keys.set("partial", &error.to_string()),
            _ => {}
        }
        if matches!(self.sensor, Sensor::Board) {
            self.lag.take_out(&mut file);
            self.zero.count_from(&mut file);
        }
        Measured {
            file,
            limits: std::mem::take(&mut self.limits),
            impossible: *read.as_ref().unwrap_or(&Impossible::NONE),
            ended: ended.and_then(|ended| off.and(read.map(drop)).map(|()| ended)),
        }
    }

    /// The board's control ticks a second.
    pub(crate) fn tick_hz(&self) -> u32 {
        self.board.identity().tick_hz
    }

    /// Computes something in a thread of its own, so that Ctrl-C ends the waiting for it.
    pub(crate) async fn aside<T: Send + 'static>(
        &self,
        what: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ToolError> {
        let (send, done) = oneshot::channel();
        thread::spawn(move || {
            // Nobody waits any more after Ctrl-C.
            let _ = send.send(work());
        });
        self.progress.clear();
        let spinner = spinner(what, self.quiet);
        let done = async { done.await.map_err(|_| ToolError::Defect { what }) };
        let done = self.interrupt.or(done).await;
        spinner.finish_and_clear();
        done
    }

    /// Says something above the bar.
    pub(crate) fn say(&self, words: &str) {
        if !self.quiet {
            self.progress.say(words);
        }
    }

    /// The bar disappears.
    pub(crate) fn close(self) {
        self.progress.clear();
    }

    fn header(&self, experiment: &Experiment) -> MeasurementFile {
        let mut file = header(self.board, &experiment.name, &self.session);
        if let Some(drive) = experiment.drive_key() {
            file.keys.set("drive", &drive);
        }
        file
    }

    async fn perform(
        &mut self,
        experiment: &Experiment,
        pieces: &[Piece],
        file: &mut MeasurementFile,
    ) -> Result<(), ToolError> {
        let board = self.board;
        let off = board.off().await?;
        self.started_tick = off.tick;
        self.zero.begin(experiment.prehold.is_some());
        if let Some(noise_um) = self.noise_um().await? {
            let mean_ticks = pieces
                .first()
                .map_or(1, |piece| piece.stream.mean_ticks.max(1));
            set_noise(file, noise_um / f64::from(mean_ticks).sqrt());
        }
        self.wait(off.tick, experiment.rest_s).await?;
        if let Some(noise_um) = self.sensor.noise_at_rest_um() {
            set_noise(file, noise_um);
        }
        if matches!(self.sensor, Sensor::Board) {
            let rest = sensor_um(board).await?;
            if self.zero.um.is_none() {
                self.count_from_here(&rest).await?;
            }
        }
        let mut passed_s = 0.0;
        for (index, piece) in pieces.iter().enumerate() {
            if piece.rest_s > 0.0 {
                let off = board.off().await?;
                self.wait(off.tick, piece.rest_s).await?;
            }
            board.load_points(&piece.points).await?;
            let prehold = match experiment.prehold {
                Some(Prehold { volts, seconds }) if index == 0 => {
                    let drive_v = [volts as f32; 4];
                    let held = board
                        .set_drive(Drives {
                            drive_v,
                            lease_ms: LEASE_MS,
                        })
                        .await?;
                    self.wait(held.tick, seconds).await?;
                    Some((volts, held.tick.wrapping_add(1)))
                }
                _ => None,
            };
            self.play(piece, passed_s, prehold, file).await?;
            // The last row is a tick before its dwell ends.
            passed_s = file.rows.last().map_or(0.0, |row| row.t_s) + board.span(0, 1).s;
        }
        self.sensor.hear_on(self.lag.span).await;
        Ok(())
    }

    async fn wait(&self, tick: u32, seconds: f64) -> Result<(), ToolError> {
        let seconds = Span { s: seconds };
        let reach = |status: &Status| {
            self.reach(status.telemetry.tick);
            Ok(())
        };
        self.board.wait_while(tick, seconds, reach).await
    }

    fn reach(&self, tick: u32) {
        let passed = self.board.span(self.started_tick, tick);
        self.progress.reach(passed.s);
    }
}
