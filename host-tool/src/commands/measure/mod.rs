//! `measure`: the paper's experiments on any board, as measurement files.

pub(crate) mod header;
mod journal;
pub(crate) mod keyboard;
mod lag;
pub(super) mod plane;
mod point;
pub(crate) mod possible;
mod progress;
pub(crate) mod readings;
pub(super) mod reference;
mod report;
mod rest;
pub(crate) mod rested;
pub(crate) mod run;
pub(crate) mod sensor;
mod serial;
pub(crate) mod spots;

use std::path::PathBuf;

use experiments::{Experiment, Quantity, SETTLING_S};
use quantities::Voltage;

use self::possible::{check_drive, make_directory};
use self::report::MeasureReport;
use self::run::{Bench, Ended};
use self::sensor::Sensor;
use crate::board::Board;
use crate::cli::DriveExperiment;
use crate::error::{OutputError, ToolError};
use crate::new_file::NewFile;
use crate::report::{decimal, print};
use crate::verbosity::note;

/// Measures, and leaves the channels off.
pub(super) async fn run(
    board: &Board,
    asked: DriveExperiment,
    json: bool,
) -> Result<(), ToolError> {
    let experiments = planned(&asked, board.identity().tick_hz)?;
    let instruments = asked.instruments();
    let status = board.status().await?;
    check_drives(&experiments, decimal(status.max_drive_v))?;
    let sensor = Sensor::open(&instruments.sensor)?;
    if !sensor.is_there(board).await? {
        note(
            "the board reads no position sensor, which is none at its input or a silent one: currents only, or name a --sensor",
        );
    }
    let mut files = new_files(&asked, &experiments, instruments.force)?;
    let mut report = MeasureReport {
        measured: Vec::new(),
        dropped_samples: 0,
        interrupted: false,
    };
    let bench = Bench::open(board, sensor, instruments.ambient_c, json).await?;
    let mut bench = bench.with_sensor_lag(instruments.sensor_lag);
    bench.plan(&experiments);
    let mut failed = Ok(());
    for (experiment, file) in experiments.iter().zip(files.drain(..)) {
        let (file, ended) = bench.measure_into(experiment, file).await;
        report.measured.extend(file);
        match ended {
            Ok(Ended::Complete) => {}
            Ok(Ended::Interrupted) => report.interrupted = true,
            Err(error) => failed = Err(error),
        }
        if report.interrupted || failed.is_err() {
            break;
        }
    }
    bench.close();
    if failed.is_ok() {
        let dropped = board.status().await?.dropped_samples;
        report.dropped_samples = dropped.wrapping_sub(status.dropped_samples);
    }
    print(&report, json);
    match report.interrupted {
        true => failed.and(Err(ToolError::Interrupted)),
        false => failed,
    }
}

/// What is played, after the rests that were asked for; found out to be playable before anything moves. A session begins when what
/// the mirror remembers of earlier drives has faded: all that it shows counts from there.
fn planned(asked: &DriveExperiment, tick_hz: u32) -> Result<Vec<Experiment>, ToolError> {
    let mut experiments = asked.measurement().experiments();
    if let (Some(file), [experiment]) = (asked.file(), experiments.as_mut_slice()) {
        experiment.rest_s = file.rest.s;
    }
    if let (DriveExperiment::Session { .. }, Some(first)) = (asked, experiments.first_mut()) {
        first.rest_s = SETTLING_S;
    }
    for experiment in &experiments {
        experiment_player::pieces(experiment, tick_hz)?;
    }
    Ok(experiments)
}

/// One file an experiment, found out to be writable before anything moves.
fn new_files(
    asked: &DriveExperiment,
    experiments: &[Experiment],
    force: bool,
) -> Result<Vec<NewFile>, OutputError> {
    let default = |experiment: &Experiment| PathBuf::from(format!("{}.csv", experiment.name));
    let paths: Vec<PathBuf> = match asked {
        DriveExperiment::Session { output, .. } => {
            make_directory(output)?;
            let name = |experiment| output.join(default(experiment));
            experiments.iter().map(name).collect()
        }
        _ => {
            let named = asked.file().and_then(|file| file.output.clone());
            let name = |experiment| named.clone().unwrap_or_else(|| default(experiment));
            experiments.iter().map(name).collect()
        }
    };
    let create = |path| NewFile::create(path, force);
    paths.into_iter().map(create).collect()
}

/// Nothing is driven that the board would limit: the file would not tell what it seems to.
fn check_drives(experiments: &[Experiment], max_v: f64) -> Result<(), ToolError> {
    let max = Voltage { v: max_v };
    for run in experiments.iter().flat_map(|experiment| &experiment.runs) {
        if let Quantity::Voltage { .. } = run.quantity {
            let (lowest_v, highest_v) = run.signal.range();
            check_drive(Voltage { v: lowest_v }, max)?;
            check_drive(Voltage { v: highest_v }, max)?;
        }
    }
    Ok(())
}
