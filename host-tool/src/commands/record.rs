//! `record`: a measurement file of what the board reads while it goes on with what it does.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use measurement::{MeasurementFile, Row};
use mirror_protocol::Telemetry;
use serde::Serialize;

use crate::board::{Board, Samples};
use crate::error::ToolError;
use crate::quantity::Span;
use crate::report;

#[derive(Serialize)]
struct Recorded {
    file: PathBuf,
    samples: usize,
    duration_s: f64,
}

/// A file that is there and can be written, before anything is measured.
pub(super) struct NewFile {
    path: PathBuf,
    file: File,
}

impl NewFile {
    pub(super) fn create(path: PathBuf, replace: bool) -> Result<Self, ToolError> {
        let mut options = OpenOptions::new();
        options.write(true);
        // An existing file keeps its content until there is something to replace it with.
        let opened = if replace { options.create(true) } else { options.create_new(true) }.open(&path);
        match opened {
            Ok(file) => Ok(Self { path, file }),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                Err(ToolError::FileExists { path })
            }
            Err(source) => Err(ToolError::Write { path, source }),
        }
    }

    fn write(mut self, text: &str) -> Result<PathBuf, ToolError> {
        let written = self.file.set_len(0).and_then(|()| self.file.write_all(text.as_bytes()));
        match written {
            Ok(()) => Ok(self.path),
            Err(source) => Err(ToolError::Write { path: self.path, source }),
        }
    }
}

pub(super) async fn run(
    board: &Board,
    file: NewFile,
    duration: Span,
    period: Span,
    json: bool,
) -> Result<(), ToolError> {
    let expected = ((duration.s / period.s).round() as u32).max(1);
    let mut stream = match board.stream(period, expected).await {
        Ok(stream) => stream,
        Err(error) => {
            // Nothing was measured, so no file is left.
            let _ = fs::remove_file(&file.path);
            return Err(error);
        }
    };
    let (samples, ended) = collect(&mut stream, expected, json).await;
    let recording = measurement(board, &samples);
    let recorded = Recorded {
        file: file.write(&recording.to_string())?,
        samples: samples.len(),
        duration_s: recording.rows.last().map_or(0.0, |row| row.t_s),
    };
    report::print(&recorded, json);
    ended
}

/// Samples until there are enough; those that arrived are kept whatever happens.
async fn collect(
    stream: &mut Samples,
    expected: u32,
    quiet: bool,
) -> (Vec<Telemetry>, Result<(), ToolError>) {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(expected.into()) };
    let style = ProgressStyle::with_template("recording {wide_bar} {pos}/{len} samples, {eta} left");
    bar.set_style(style.expect("a fixed template"));
    let mut samples = Vec::new();
    while samples.len() < expected as usize {
        match stream.next().await {
            Ok(sample) => samples.push(sample),
            Err(error) => {
                bar.abandon();
                return (samples, Err(error));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    (samples, Ok(()))
}

fn measurement(board: &Board, samples: &[Telemetry]) -> MeasurementFile {
    let identity = board.identity();
    let mut file = MeasurementFile::default();
    file.keys.set("experiment", "record");
    file.keys.set("device", identity.board.name());
    let first = samples.first().map_or(0, |sample| sample.tick);
    file.rows = samples
        .iter()
        .map(|sample| row(sample, sample.tick.wrapping_sub(first), identity.tick_hz))
        .collect();
    file
}

fn row(sample: &Telemetry, ticks: u32, tick_hz: u32) -> Row {
    Row {
        t_s: f64::from(ticks) / f64::from(tick_hz),
        voltage_v: sample.drive_v.map(f64::from),
        current_a: sample.current_a.map(|current| Some(current.into())),
        z_um: sample.sensor_z_um.map(f64::from),
        ..Row::default()
    }
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "recorded   {} samples of {} s in {}",
            self.samples,
            self.duration_s,
            self.file.display()
        )
    }
}
