//! Which of a file's own keys hold of what is made of it.

use super::assignment::Assignment;
use super::table::Table;
use crate::column::Column;
use crate::{Keys, Row};

/// The keys of a table that hold of what is made of it: with `settled`, means of these rows over equal drives. What is left out is told.
pub(super) fn kept(
    table: &Table,
    assignments: &[Assignment],
    settled: Option<&[Row]>,
    notes: &mut Vec<String>,
) -> Keys {
    let are_kept = |is_it: fn(Column) -> bool| {
        let mut those = assignments.iter().filter(|a| is_it(a.column));
        those.all(|a| Column::from_name(&table.names[a.source]) == Some(a.column) && a.is_plain())
    };
    let is_mean = |pair: &[Row]| pair[0].voltage_v == pair[1].voltage_v;
    let are_means = settled.is_some_and(|rows| rows.windows(2).any(is_mean));
    let is_current = |column| matches!(column, Column::CurrentOfEach | Column::Current(_));
    let is_time = |column| column == Column::Time;
    let is_displacement = |column| column == Column::Displacement;
    let holds = |key: &str| match key {
        // Of means it is another one.
        "noise_z_nm" => !are_means && are_kept(is_displacement),
        "noise_I_uA" | "noise_I_ratio" => !are_means && are_kept(is_current),
        "noise_V_mV" => are_kept(Column::is_drive),
        "drive" | "prehold_V" | "prehold_s" => {
            settled.is_none() && are_kept(is_time) && are_kept(Column::is_drive)
        }
        _ => true,
    };
    let mut keys = Keys::default();
    for (key, value) in table.keys.iter() {
        if holds(key) {
            keys.set(key, value);
        } else {
            notes.push(format!(
                "{key}={value} is left out: it does not hold of what is made here"
            ));
        }
    }
    keys
}
