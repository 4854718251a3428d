//! A temperature that rises with the drive: a heater's, and no room's.

use super::assignment::Assignment;
use super::table::Table;
use crate::Row;
use crate::column::Column;

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
    let read = rows.iter().filter_map(|row| {
        let square: f64 = row.voltage_v.iter().map(|volts| volts * volts).sum();
        Some((square, row.ambient_c?))
    });
    let read: Vec<(f64, f64)> = read.collect();
    let temperatures = || read.iter().map(|(_, celsius)| *celsius);
    let rise_k = temperatures().fold(f64::MIN, f64::max) - temperatures().fold(f64::MAX, f64::min);
    if rise_k < ROOM_K || determination(&read) < FOLLOWS {
        return;
    }
    rows.iter_mut().for_each(|row| row.ambient_c = None);
    notes.push(format!(
        "'{}' follows the drive, by {rise_k:.1} K, and is left out: it is no room's; if it is, say --column T_ambient={}",
        table.names[ambient.source],
        ambient.source + 1
    ));
}

/// The square of the correlation; 0 where one of both does not change.
fn determination(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len().max(1) as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|pair| pair.0), mean(&|pair| pair.1));
    let both = mean(&|pair| (pair.0 - x) * (pair.1 - y));
    let squares = mean(&|pair| (pair.0 - x).powi(2)) * mean(&|pair| (pair.1 - y).powi(2));
    if squares > 0.0 {
        both * both / squares
    } else {
        0.0
    }
}
