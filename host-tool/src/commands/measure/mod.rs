//! `measure`: the paper's experiments on any board, as measurement files.

pub(crate) mod experiment;
mod interrupt;
mod keyboard;
pub(super) mod plane;
pub(crate) mod play;
mod point;
pub(super) mod reference;
mod rows;
pub(crate) mod run;
pub(crate) mod sensor;
mod serial;
mod spots;

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use self::experiment::Experiment;
use self::run::{Ended, Lab};
use self::sensor::Sensor;
use crate::board::Board;
use crate::cli::{Experiment as Asked, Instruments};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::quantity::Voltage;
use crate::report::{self, decimal};

#[derive(Serialize)]
struct Report {
    measured: Vec<MeasuredFile>,
    /// Samples that found the link too slow.
    dropped_samples: u32,
    interrupted: bool,
}

#[derive(Serialize)]
struct MeasuredFile {
    file: PathBuf,
    rows: usize,
}

/// Measures, and leaves the channels off.
pub(super) async fn run(board: &Board, asked: Asked, json: bool) -> Result<(), ToolError> {
    let tick_hz = board.identity().tick_hz;
    let (experiments, instruments) = plan(&asked, tick_hz)?;
    let status = board.status().await?;
    check_drives(&experiments, decimal(status.max_drive_v))?;
    let sensor = Sensor::open(&instruments.sensor)?;
    if matches!(sensor, Sensor::Board) && status.telemetry.sensor_z_um.is_none() {
        eprintln!("this board has no position sensor: currents only, or name a --sensor");
    }
    let mut files = new_files(&asked, &experiments, instruments.force)?;
    let mut report = Report {
        measured: Vec::new(),
        dropped_samples: 0,
        interrupted: false,
    };
    let mut lab = Lab::open(board, sensor, instruments.ambient_c, json).await?;
    let mut failed = Ok(());
    for (experiment, file) in experiments.iter().zip(files.drain(..)) {
        let measured = lab.measure(experiment).await;
        let rows = measured.file.rows.len();
        // An empty file would be no measurement.
        if rows > 0 {
            let file = file.write(&measured.file.to_string())?;
            report.measured.push(MeasuredFile { file, rows });
        }
        match measured.ended {
            Ok(Ended::Complete) => {}
            Ok(Ended::Interrupted) => report.interrupted = true,
            Err(error) => failed = Err(error),
        }
        if report.interrupted || failed.is_err() {
            break;
        }
    }
    lab.close();
    if failed.is_ok() {
        let dropped = board.status().await?.dropped_samples;
        report.dropped_samples = dropped.wrapping_sub(status.dropped_samples);
    }
    report::print(&report, json);
    failed
}

fn plan(asked: &Asked, tick_hz: u32) -> Result<(Vec<Experiment>, &Instruments), ToolError> {
    let one = |experiment: Experiment, rest_s: f64| vec![experiment.after(rest_s)];
    Ok(match asked {
        Asked::Sweep {
            max,
            steps,
            dwell,
            repeat,
            to,
        } => (
            one(
                Experiment::sweep(*max, *steps, *dwell, *repeat, tick_hz)?,
                to.rest.s,
            ),
            &to.instruments,
        ),
        Asked::Step {
            volts,
            hold,
            rate,
            to,
        } => (
            one(Experiment::step(*volts, *hold, *rate, tick_hz)?, to.rest.s),
            &to.instruments,
        ),
        Asked::Sine {
            mean,
            amplitude,
            frequency,
            cycles,
            to,
        } => (
            one(
                Experiment::sine(*mean, *amplitude, *frequency, *cycles, tick_hz)?,
                to.rest.s,
            ),
            &to.instruments,
        ),
        Asked::Single {
            max,
            steps,
            dwell,
            to,
        } => (
            one(
                Experiment::single(*max, *steps, *dwell, tick_hz)?,
                to.rest.s,
            ),
            &to.instruments,
        ),
        Asked::Held { volts, dwell, to } => (
            one(Experiment::held(volts, *dwell, tick_hz)?, to.rest.s),
            &to.instruments,
        ),
        Asked::Session {
            max, instruments, ..
        } => (experiment::session(*max, tick_hz)?, instruments),
    })
}

/// One file an experiment, found out to be writable before anything moves.
fn new_files(
    asked: &Asked,
    experiments: &[Experiment],
    force: bool,
) -> Result<Vec<NewFile>, ToolError> {
    let default = |experiment: &Experiment| PathBuf::from(format!("{}.csv", experiment.name));
    match asked {
        Asked::Session { output, .. } => {
            make_directory(output)?;
            experiments
                .iter()
                .map(|experiment| NewFile::create(output.join(default(experiment)), force))
                .collect()
        }
        Asked::Sweep { to, .. }
        | Asked::Step { to, .. }
        | Asked::Sine { to, .. }
        | Asked::Single { to, .. }
        | Asked::Held { to, .. } => experiments
            .iter()
            .map(|experiment| {
                let path = to.output.clone().unwrap_or_else(|| default(experiment));
                NewFile::create(path, force)
            })
            .collect(),
    }
}

fn make_directory(path: &Path) -> Result<(), ToolError> {
    fs::create_dir_all(path).map_err(|source| ToolError::Write {
        path: path.to_owned(),
        source,
    })
}

/// Nothing is driven that the board would limit: the file would not tell what it seems to.
fn check_drives(experiments: &[Experiment], max_v: f64) -> Result<(), ToolError> {
    let max = Voltage { v: max_v };
    for run in experiments.iter().flat_map(|experiment| &experiment.runs) {
        let (middle, reach) = (run.waveform.offset, run.waveform.amplitude.abs());
        for volts in [middle - reach, middle + reach] {
            check_drive(Voltage { v: decimal(volts) }, max)?;
        }
    }
    Ok(())
}

fn check_drive(asked: Voltage, max: Voltage) -> Result<(), ToolError> {
    if (-1e-6..=max.v + 1e-6).contains(&asked.v) {
        Ok(())
    } else {
        Err(ToolError::DriveOutOfRange { asked, max })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for MeasuredFile { file, rows } in &self.measured {
            writeln!(f, "measured   {rows:>6} rows in {}", file.display())?;
        }
        if self.dropped_samples > 0 {
            writeln!(
                f,
                "dropped    {} samples: the link was too slow",
                self.dropped_samples
            )?;
        }
        if self.interrupted {
            writeln!(f, "interrupted; channels are off")?;
        }
        Ok(())
    }
}
