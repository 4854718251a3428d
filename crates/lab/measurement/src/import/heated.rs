//! A temperature that rises with the drive: a heater's, and no room's.

use super::assignment::Assignment;
use super::table::Table;
use crate::Row;
use crate::column::Column;
use crate::correlation::correlation;

/// A room gets warmer by less than this while a mirror of some 0.1 W is driven (K): a choice.
const ROOM_K: f64 = 5.0;
/// So much of the temperature's variance is that of the drive's square: a choice, far above a room's and below a heater's.
const FOLLOWS: f64 = 0.8;

/// Empties a temperature whose heading does not say what has it, where it follows the drive; says so.
pub(super) fn temperature(
    table: &Table,
    assignments: &[Assignment],
    rows: &mut [Row],
    notes: &mut Vec<String>,
) {
    let mut ambients = assignments.iter().filter(|a| a.column == Column::Ambient);
    let Some(ambient) = ambients.find(|a| a.is_of_anything(table)) else {
        return;
    };
    let read = rows
        .iter()
        .filter_map(|row| Some((row.heating(), row.ambient_c?)));
    let read: Vec<(f64, f64)> = read.collect();
    let temperatures = || read.iter().map(|(_, celsius)| *celsius);
    let rise_k = temperatures().fold(f64::MIN, f64::max) - temperatures().fold(f64::MAX, f64::min);
    if rise_k < ROOM_K || correlation(&read).is_none_or(|it| it * it < FOLLOWS) {
        return;
    }
    rows.iter_mut().for_each(|row| row.ambient_c = None);
    notes.push(format!(
        "'{}' follows the drive, by {rise_k:.1} K, and is left out: it is no room's; if it is, say --column T_ambient={}",
        table.names[ambient.source],
        ambient.source + 1
    ));
}
