//! `measure reference`: what the sensor reads where a stage has moved the resting mirror by known heights.

use measurement::{MeasurementFile, Row};

use super::header::header;
use super::journal::Journal;
use super::keyboard::Keyboard;
use super::point::Points;
use super::possible::make_directory;
use super::report::{MeasureReport, MeasuredFile};
use super::run::{Ended, attended, partial, whole};
use crate::board::Board;
use crate::cli;
use crate::commands::interrupt::Interrupt;
use crate::error::{SensorFault, ToolError};
use crate::new_file::NewFile;
use crate::report;
use crate::verbosity::{note, say};

/// A sensor whose gain is off by more than a half, in either direction, has not seen what the stage is said to have done; the errors that
/// a diagnosis finds are some percent.
const GAINS: std::ops::Range<f64> = 0.5..2.0;
/// Steps from so much on are looked at so (um): fifty times the noise of a good sensor, 20 nm.
const SEEN_UM: f64 = 1.0;

/// Asks for each height, and reads the sensor there; nothing is driven.
pub(crate) async fn run(board: &Board, ask: cli::Reference, json: bool) -> Result<(), ToolError> {
    let points = Points::open(board, &ask.instruments).await?;
    if let Some(folder) = ask.output.parent() {
        make_directory(folder)?;
    }
    let file = NewFile::create(ask.output.clone(), ask.instruments.force)?;
    let interrupt = Interrupt::listen()?;
    note("letting the mirror come to rest");
    let rested = interrupt.or(points.come_to_rest()).await?;
    if let Some(unrest) = rested.unrest() {
        say(unrest);
    }
    let points = points.begin().await?;
    let mut measured = header(board, "reference", points.session());
    let mut journal = Journal::new(file);
    let ladder = climb(board, &points, &ask, &mut measured, &mut journal);
    let ended = attended(board, &interrupt, ladder).await;
    if let Some(partial) = partial(&ended) {
        measured.keys.set("partial", &partial);
    }
    let mut report = MeasureReport {
        measured: Vec::new(),
        dropped_samples: 0,
        interrupted: matches!(ended, Ok(Ended::Interrupted)),
    };
    // Rows are read in pairs: one alone would be no measurement.
    let rows = measured.rows.len();
    match journal.into_recording() {
        Some(recording) if rows > 1 => {
            let file = recording.replace(&measured.to_string())?;
            report.measured.push(MeasuredFile {
                file,
                rows,
                without_displacement: 0,
            });
        }
        Some(recording) => recording.discard()?,
        None => {}
    }
    report::print(&report, json);
    whole(ended)
}

/// Reads every height, and appends it to the file at once. Displacements count from the first.
async fn climb(
    board: &Board,
    points: &Points<'_>,
    ask: &cli::Reference,
    measured: &mut MeasurementFile,
    journal: &mut Journal,
) -> Result<(), ToolError> {
    let mut keyboard = Keyboard::new();
    let (mut first, count) = (None, ask.heights.len());
    for (number, height) in (1..).zip(&ask.heights) {
        let question = format!("{number} of {count}: move the stage to {height}, then Enter");
        keyboard.ask(&question).await?;
        let arrived = board.status().await?.telemetry.tick;
        board.wait(arrived, ask.settle).await?;
        let (um, row) = points.read().await?;
        let (from_um, zero_um) = *first.get_or_insert((height.um, um));
        check_step(height.um - from_um, um - zero_um)?;
        let row = Row {
            z_um: Some(um),
            reference_um: Some(height.um),
            ..row
        };
        journal.begin(&measured.keys, &row)?;
        journal.append(row, Some(zero_um))?;
        measured.rows.push(Row {
            z_um: Some(um - zero_um),
            ..row
        });
    }
    Ok(())
}

/// Whether a sensor that reads this (um) has seen a stage move so far (um).
fn check_step(moved_um: f64, read_um: f64) -> Result<(), ToolError> {
    let gain = read_um / moved_um;
    if moved_um.abs() < SEEN_UM || GAINS.contains(&gain) {
        return Ok(());
    }
    let found = match gain {
        gain if gain.abs() < GAINS.start => "was the stage moved?",
        gain if gain < 0.0 => "it moved the other way, or the sensor counts the other way.",
        _ => "does the stage or the sensor count in another unit?",
    };
    Err(SensorFault::StageUnseen {
        moved_um,
        read_um,
        found,
    }
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_the_sensor_does_not_see_is_told() {
        for (moved_um, read_um) in [(50.0, 51.5), (-50.0, -40.0), (0.0, 3.0), (0.5, -0.2)] {
            assert!(
                check_step(moved_um, read_um).is_ok(),
                "{moved_um} {read_um}"
            );
        }
        for (moved_um, read_um, told) in [
            (50.0, 0.004, "was the stage moved?"),
            (50.0, -50.0, "the other way"),
            (-50.0, 49.0, "the other way"),
            (50.0, 1270.0, "another unit"),
        ] {
            let said = check_step(moved_um, read_um).expect_err("told").to_string();
            assert!(said.contains(told), "{said}");
        }
    }
}
