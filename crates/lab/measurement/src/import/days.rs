//! Times as a spreadsheet counts them: in days.

use super::assignment::Assignment;
use crate::Row;
use crate::column::Column;

/// Days from the one that spreadsheets count from to the years 2000 and 2100 (ECMA-376, part 1, section 18.17.4.1).
const THIS_CENTURY: (f64, f64) = (36_526.0, 73_051.0);
/// Rows of a measurement are nearer to each other than this, as a median (days): a minute and a half. A clock of seconds that has gone for
/// ten hours is read in milliseconds then.
const NEAR: f64 = 1e-3;
const SECONDS: f64 = 86_400.0;

/// Brings times that nobody has given a unit and that can only be days into seconds from the first; says so.
pub(super) fn into_seconds(assignments: &[Assignment], rows: &mut [Row], notes: &mut Vec<String>) {
    let mut times = assignments.iter().filter(|a| a.column == Column::Time);
    let Some(time) = times.next().filter(|time| !time.has_unit()) else {
        return;
    };
    let is_date = |row: &Row| (THIS_CENTURY.0..THIS_CENTURY.1).contains(&row.t_s);
    let apart = rows
        .windows(2)
        .map(|pair| (pair[1].t_s - pair[0].t_s).abs());
    let is_near = rows.len() > 1 && crate::median(apart.collect()) < NEAR;
    if !is_near || !rows.iter().all(is_date) {
        return;
    }
    let first = rows
        .iter()
        .fold(f64::INFINITY, |first, row| first.min(row.t_s));
    rows.iter_mut()
        .for_each(|row| row.t_s = (row.t_s - first) * SECONDS);
    notes.push(format!(
        "times from {first:.5} on, without a unit, are taken for a spreadsheet's days and count from the first row's: if they are \
         seconds, say --column t={}:s",
        time.source + 1
    ));
}
