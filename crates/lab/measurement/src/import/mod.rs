//! Tables of other programs and instruments as measurement files: other delimiters, decimal commas, encodings, column names,
//! units and signs.
//!
//! 1. [`Table`]: a text becomes named columns of numbers, as it is;
//! 2. [`Assignment`]: which of them is which quantity, in which unit, guessed from its name or said by the user;
//! 3. [`import`]: rows, with what was noticed and done on the way in sentences.

mod assignment;
mod table;

pub use assignment::{Assignment, guesses};
pub use table::Table;

use crate::column::Column;
use crate::{MeasurementFile, Row};
use miette::Diagnostic;
use thiserror::Error;

/// Why a table is no measurement.
#[derive(Debug, Error, Diagnostic, PartialEq)]
#[error("{message}")]
#[diagnostic(help("{help}"))]
pub struct ImportError {
    message: String,
    help: String,
}

impl ImportError {
    fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
        }
    }
}

/// A measurement, and what was noticed and done on the way.
#[derive(Debug)]
pub struct Imported {
    /// The measurement.
    pub file: MeasurementFile,
    /// Sentences for people.
    pub notes: Vec<String>,
}

/// The measurement in a table. With `settled` every run of rows at one drive is one settled reading, their mean; the spread of a
/// displacement about it becomes its noise.
///
/// # Errors
/// Where no column is a drive, a quantity stands in two columns, or fewer than two rows are left.
pub fn import(
    table: &Table,
    assignments: &[Assignment],
    settled: bool,
) -> Result<Imported, ImportError> {
    check(table, assignments)?;
    let mut notes = Vec::new();
    let mut rows = rows(table, assignments, &mut notes);
    let mut file = MeasurementFile::default();
    let is_timed = assignments.iter().any(|a| a.column == Column::Time);
    if settled {
        let (means, noise_um) = means(&rows);
        notes.push(format!(
            "{} rows are {} settled readings, means over equal drives",
            rows.len(),
            means.len()
        ));
        if let Some(um) = noise_um {
            file.keys.set("noise_z_nm", &format!("{:.3}", 1e3 * um));
        }
        rows = means;
    } else if is_timed {
        rows = at_their_times(rows, &mut notes);
    }
    if settled || !is_timed {
        file.keys.set("steady", "yes");
    }
    count_from_rest(&mut rows, &mut notes);
    if rows.len() < 2 {
        return Err(ImportError::new(
            format!(
                "{} rows are left, and a measurement needs two at least",
                rows.len()
            ),
            "a row needs a number for the drive, and for the time where there is one",
        ));
    }
    file.rows = rows;
    Ok(Imported { file, notes })
}

fn check(table: &Table, assignments: &[Assignment]) -> Result<(), ImportError> {
    for (index, one) in assignments.iter().enumerate() {
        if let Some(other) = assignments[..index].iter().find(|o| o.column == one.column) {
            let names = [other, one].map(|a| table.names[a.source].as_str());
            return Err(ImportError::new(
                format!(
                    "the columns '{}' and '{}' would both be {}",
                    names[0],
                    names[1],
                    one.quantity()
                ),
                format!(
                    "say which one is: --column {}='{}'",
                    one.quantity(),
                    names[0]
                ),
            ));
        }
    }
    let is_drive = |a: &Assignment| matches!(a.column, Column::VoltageOfAll | Column::Voltage(_));
    if assignments.iter().any(is_drive) {
        return Ok(());
    }
    Err(ImportError::new(
        format!(
            "none of the columns {} is a voltage",
            table.names.join(", ")
        ),
        "say which one is, with its unit: --column V=NAME:mV",
    ))
}

/// The rows that have all that a row needs.
fn rows(table: &Table, assignments: &[Assignment], notes: &mut Vec<String>) -> Vec<Row> {
    let row = |cells: &Vec<Option<f64>>| {
        let mut row = Row::default();
        for assignment in assignments {
            match cells[assignment.source] {
                Some(number) => assignment.column.store(&mut row, assignment.value(number)),
                None if assignment.column.may_be_empty() => {}
                None => return None,
            }
        }
        Some(row)
    };
    let rows: Vec<Row> = table.rows.iter().filter_map(row).collect();
    let lacking = table.rows.len() - rows.len();
    if lacking > 0 {
        notes.push(format!(
            "{lacking} rows without a time or a drive are left out"
        ));
    }
    rows
}

/// Rows of the same instant become one; time counts from the first, and is brought into order.
fn at_their_times(mut rows: Vec<Row>, notes: &mut Vec<String>) -> Vec<Row> {
    if !rows.is_sorted_by(|a, b| a.t_s <= b.t_s) {
        notes.push("the rows are brought into the order of their times".into());
        rows.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    }
    let instants: Vec<Row> = rows.chunk_by(|a, b| a.t_s == b.t_s).map(mean).collect();
    if instants.len() < rows.len() {
        notes.push(format!(
            "{} rows share their time with another one: means are taken",
            rows.len() - instants.len()
        ));
    }
    instants
}

/// Means over runs of equal drives, and the standard error of such a mean's displacement, pooled (um).
fn means(rows: &[Row]) -> (Vec<Row>, Option<f64>) {
    let runs: Vec<&[Row]> = rows.chunk_by(|a, b| a.voltage_v == b.voltage_v).collect();
    let (mut squares, mut freedom, mut samples, mut count) = (0.0, 0usize, 0usize, 0usize);
    for run in &runs {
        let z: Vec<f64> = run.iter().filter_map(|row| row.z_um).collect();
        if z.len() > 1 {
            let middle = z.iter().sum::<f64>() / z.len() as f64;
            squares += z.iter().map(|z| (z - middle).powi(2)).sum::<f64>();
            freedom += z.len() - 1;
            samples += z.len();
            count += 1;
        }
    }
    let a_mean = samples as f64 / count.max(1) as f64;
    let noise_um =
        (freedom > 0 && squares > 0.0).then(|| (squares / freedom as f64 / a_mean).sqrt());
    (runs.into_iter().map(mean).collect(), noise_um)
}

/// The mean of rows, of what each of them has.
fn mean(rows: &[Row]) -> Row {
    let of = |value: &dyn Fn(&Row) -> Option<f64>| {
        let values: Vec<f64> = rows.iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    Row {
        t_s: rows[0].t_s,
        voltage_v: std::array::from_fn(|actuator| {
            of(&|row| Some(row.voltage_v[actuator])).unwrap_or_default()
        }),
        current_a: std::array::from_fn(|actuator| of(&|row| row.current_a[actuator])),
        z_um: of(&|row| row.z_um),
        ambient_c: of(&|row| row.ambient_c),
        ..rows[0]
    }
}

/// Displacements count from the first one at 0 V; one that falls with the drive is told.
fn count_from_rest(rows: &mut [Row], notes: &mut Vec<String>) {
    let rest = rows
        .iter()
        .filter(|row| row.voltage_v.iter().all(|volts| *volts == 0.0))
        .find_map(|row| row.z_um);
    match rest {
        Some(0.0) => {}
        Some(rest_um) => {
            for z_um in rows.iter_mut().filter_map(|row| row.z_um.as_mut()) {
                *z_um -= rest_um;
            }
            notes.push(format!(
                "z counts from its first reading at 0 V, which was {rest_um} um"
            ));
        }
        None if rows.iter().any(|row| row.z_um.is_some()) => notes.push(
            "no displacement was read at 0 V: z is taken to count from there all the same".into(),
        ),
        None => {}
    }
    let highest = |row: &&Row| row.voltage_v.into_iter().fold(0.0, f64::max);
    let read = rows.iter().filter(|row| row.z_um.is_some());
    let driven = read.max_by(|a, b| highest(a).total_cmp(&highest(b)));
    if driven
        .and_then(|row| row.z_um)
        .is_some_and(|z_um| z_um < 0.0)
    {
        notes.push(
            "z falls with the drive, and is to grow towards the substrate: if the sensor counts the other way, say \
             --column z=NAME:UNIT:-1"
                .into(),
        );
    }
}
