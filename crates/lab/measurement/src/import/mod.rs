//! Tables of other programs and instruments as measurement files: other delimiters, decimal commas, encodings, column names,
//! units and signs.
//!
//! 1. [`Table`]: a text becomes named columns of numbers, as it is;
//! 2. [`Assignment`]: which of them is which quantity, in which unit, guessed from its name or said by the user;
//! 3. [`import`]: rows, with what was noticed and done on the way in sentences.

mod advice;
mod again;
mod assignment;
mod beginning;
mod cell;
mod clock;
mod days;
mod encoding;
mod epoch;
mod error;
mod guesses;
mod header;
mod heading;
mod heated;
mod instants;
mod kept;
mod kind;
mod labels;
mod lost;
mod merged;
mod moment;
mod overflow;
mod own;
mod qualified;
mod quantity;
mod reader;
mod rest;
mod runs;
mod sampling;
mod style;
mod summary;
mod table;
mod unit;
mod unlike;
mod unread;
mod untimed;
mod untold;

pub use assignment::Assignment;
pub use error::ImportError;
pub use guesses::{guesses, with_guesses};
pub use kind::{Kind, KindOfCells};
pub use table::Table;

use crate::column::Column;
use crate::held::held;
use crate::settled::Settled;
use crate::{MeasurementFile, Row};

/// Whether a text is a unit that is read: `mm`, `(mA)`.
pub fn is_unit(text: &str) -> bool {
    unit::Unit::read(text).is_some()
}

/// A measurement, and what was noticed and done on the way.
#[derive(Debug)]
pub struct Imported {
    /// The measurement.
    pub file: MeasurementFile,
    /// Sentences for people.
    pub notes: Vec<String>,
}

/// The measurement in a table. With `settled` every run of rows at one drive is one settled reading, their mean; the spread of
/// displacements and currents about it becomes their noise.
///
/// # Errors
/// Where no column is a drive, a current flows through an actuator whose drive no column tells, a quantity stands in two columns or a column is two quantities, nothing was measured, the time
/// begins anew, rows of one time have different drives, or fewer than two rows are left.
pub fn import(
    table: &Table,
    assignments: &[Assignment],
    settled: bool,
) -> Result<Imported, ImportError> {
    check(table, assignments)?;
    unlike::check(table, assignments)?;
    unread::check(table, assignments)?;
    if !settled {
        runs::check(table, assignments)?;
    }
    let is_taken = |column: usize| assignments.iter().any(|a| a.source == column);
    let told = table.told.iter();
    let told = told.filter(|(column, _)| column.is_none_or(is_taken));
    let mut notes: Vec<String> = told.map(|(_, sentence)| sentence.clone()).collect();
    let mut rows = rows(table, assignments, &mut notes);
    untold::drives(assignments, &rows, &mut notes)?;
    lost::readings(&mut rows, &mut notes);
    heated::temperature(table, assignments, &mut rows, &mut notes);
    let is_on_a_clock = is_on_a_clock(table, assignments) || epoch::is_since_one(&rows);
    if !is_on_a_clock {
        days::into_seconds(assignments, &mut rows, &mut notes);
    }
    if settled {
        rows = steadied(rows, &mut notes);
    }
    let mut file = MeasurementFile {
        keys: kept::kept(table, assignments, settled.then_some(&rows[..]), &mut notes),
        ..MeasurementFile::default()
    };
    let is_timed = assignments.iter().any(|a| a.column == Column::Time);
    if settled {
        let settled = Settled::of(rows.chunk_by(|a, b| a.voltage_v == b.voltage_v));
        notes.push(format!(
            "{} rows are {} settled readings, means over equal drives",
            rows.len(),
            settled.rows.len()
        ));
        rows = settled.states_in(&mut file.keys);
    } else if is_timed {
        rows = instants::at_their_times(rows, &mut notes)?;
    }
    if is_on_a_clock {
        count_from_the_first(&mut rows, &mut notes);
    }
    if settled || !is_timed {
        file.keys.set("steady", "yes");
    }
    if !settled && !is_timed {
        notes.extend(untimed::taken(table, assignments));
        notes.extend(untimed::apart(&rows));
    }
    rest::count_from(&mut rows, settled || !is_timed, &mut notes);
    notes.extend(falling(&rows));
    if rows.len() < 2 {
        return Err(ImportError::new(
            format!(
                "{} rows are left, and a measurement needs two at least",
                rows.len()
            ),
            advice::of_few_rows(&notes),
        ));
    }
    file.rows = rows;
    Ok(Imported { file, notes })
}

/// The drives of these rows as they were held, where they were read off a meter.
fn steadied(mut rows: Vec<Row>, notes: &mut Vec<String>) -> Vec<Row> {
    let Some(held) = held(&rows) else {
        return rows;
    };
    let drives = rows.iter_mut().zip(&held.volts);
    drives.for_each(|(row, volts)| row.voltage_v = *volts);
    notes.push(held.sentence());
    rows
}

fn check(table: &Table, assignments: &[Assignment]) -> Result<(), ImportError> {
    for (index, one) in assignments.iter().enumerate() {
        let before = &assignments[..index];
        if let Some(other) = before.iter().find(|o| o.source == one.source) {
            return Err(advice::both(table, other, one));
        }
        if before.iter().any(|o| o.column == one.column) {
            return Err(advice::twice(table, assignments, one.column));
        }
    }
    if assignments.iter().any(|a| a.column.is_drive()) {
        return Ok(());
    }
    Err(advice::no_voltage(table))
}

/// The rows that have all that a row needs.
fn rows(table: &Table, assignments: &[Assignment], notes: &mut Vec<String>) -> Vec<Row> {
    let row = |cells: &Vec<Option<f64>>| {
        let mut row = Row::default();
        for assignment in assignments {
            let cell = cells[assignment.source];
            match cell.filter(|number| !overflow::is_one(*number)) {
                Some(number) => assignment.column.store(&mut row, assignment.value(number)),
                None if assignment.column.may_be_empty() => {}
                None => return None,
            }
        }
        Some(row)
    };
    let rows: Vec<Row> = table.rows.iter().filter_map(row).collect();
    notes.extend(overflow::sentences(table, assignments));
    let lacking = table.rows.len() - rows.len();
    if lacking > 0 {
        let rows = match lacking {
            1 => "1 row without a time or a drive is".to_owned(),
            _ => format!("{lacking} rows without a time or a drive are"),
        };
        notes.push(format!("{rows} left out"));
    }
    rows
}

fn is_on_a_clock(table: &Table, assignments: &[Assignment]) -> bool {
    let mut clocks = table.kinds.iter().filter(|one| one.kind == Kind::Clock);
    clocks.any(|clock| {
        let mut times = assignments.iter().filter(|a| a.column == Column::Time);
        times.any(|time| time.source == clock.column)
    })
}

/// Dates and clock times become seconds from the first.
fn count_from_the_first(rows: &mut [Row], notes: &mut Vec<String>) {
    let Some(first_s) = rows.first().map(|row| row.t_s) else {
        return;
    };
    rows.iter_mut().for_each(|row| row.t_s -= first_s);
    notes.push("the times of the clock count from the first row's".into());
}

/// Of a displacement that falls with the drive.
fn falling(rows: &[Row]) -> Option<String> {
    let read = rows.iter().filter(|row| row.z_um.is_some());
    let driven = read.max_by(|a, b| a.highest_v().total_cmp(&b.highest_v()))?;
    driven.z_um.filter(|z_um| *z_um < 0.0)?;
    Some(
        "z falls with the drive, and is to grow towards the substrate: if the sensor counts the other way, say \
         --column z=NAME:UNIT:-1"
            .into(),
    )
}
