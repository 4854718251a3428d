//! `record`: a measurement file of what the board reads while it goes on with what it does, for as long as it was
//! told to by whoever told it.

use std::fmt;
use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use measurement::{MeasurementFile, Row};
use mirror_protocol::Telemetry;
use serde::Serialize;
use tokio::signal::ctrl_c;

use crate::board::{Board, Samples};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::quantity::Span;
use crate::report::{self, decimal};

#[derive(Serialize)]
struct Recorded {
    file: PathBuf,
    samples: usize,
    duration_s: f64,
}

pub(super) async fn run(
    board: &Board,
    file: NewFile,
    duration: Span,
    period: Span,
    json: bool,
) -> Result<(), ToolError> {
    let period_ticks = board.period_ticks(period)?;
    let period = board.span(0, period_ticks.into());
    let asked = (duration.s / period.s).round().max(1.0);
    if asked > f64::from(u32::MAX) {
        return Err(ToolError::TooManySamples { asked });
    }
    let expected = asked as u32;
    let mut stream = board.stream(period_ticks, expected).await?;
    let (samples, ended) = collect(board, &mut stream, expected, json).await;
    let recording = measurement(board, &samples);
    let recorded = Recorded {
        file: file.write(&recording.to_string())?,
        samples: samples.len(),
        duration_s: recording.rows.last().map_or(0.0, |row| row.t_s),
    };
    report::print(&recorded, json);
    match ended {
        // The board is well, so what is missing was lost on the way.
        Err(ToolError::NoAnswer { .. }) if board.status().await.is_ok() => {
            Err(ToolError::SamplesLost {
                received: samples.len(),
                expected: expected as usize,
            })
        }
        ended => ended,
    }
}

/// Samples until there are enough, or somebody presses Ctrl-C; those that arrived are kept whatever
/// happens.
async fn collect(
    board: &Board,
    stream: &mut Samples,
    expected: u32,
    quiet: bool,
) -> (Vec<Telemetry>, Result<(), ToolError>) {
    let bar = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(expected.into())
    };
    let style =
        ProgressStyle::with_template("recording {wide_bar} {pos}/{len} samples, {eta} left");
    bar.set_style(style.expect("a fixed template"));
    let mut samples = Vec::new();
    let receive = async {
        while samples.len() < expected as usize {
            samples.push(stream.next().await?);
            bar.inc(1);
        }
        Ok(())
    };
    let ended = tokio::select! {
        ended = receive => ended,
        _ = ctrl_c() => board.stop_stream().await,
    };
    bar.finish_and_clear();
    (samples, ended)
}

fn measurement(board: &Board, samples: &[Telemetry]) -> MeasurementFile {
    let identity = board.identity();
    let mut file = MeasurementFile::default();
    file.keys.set("experiment", "record");
    file.keys.set("device", &identity.board);
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
        voltage_v: sample.drive_v.map(decimal),
        current_a: sample.current_a.map(|current| Some(decimal(current))),
        z_um: sample.sensor_z_um.map(decimal),
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
