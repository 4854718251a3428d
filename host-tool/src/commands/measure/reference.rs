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
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::report;

/// Asks for each height, and reads the sensor there; nothing is driven.
pub(crate) async fn run(board: &Board, ask: cli::Reference, json: bool) -> Result<(), ToolError> {
    let points = Points::open(board, &ask.instruments).await?;
    if let Some(folder) = ask.output.parent() {
        make_directory(folder)?;
    }
    let file = NewFile::create(ask.output.clone(), ask.instruments.force)?;
    let interrupt = Interrupt::listen()?;
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
    let (mut zero_um, count) = (None, ask.heights.len());
    for (number, height) in (1..).zip(&ask.heights) {
        let question = format!("{number} of {count}: move the stage to {height}, then Enter");
        keyboard.ask(&question).await?;
        let arrived = board.status().await?.telemetry.tick;
        board.wait(arrived, ask.settle).await?;
        let (um, row) = points.read().await?;
        let zero_um = *zero_um.get_or_insert(um);
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
