//! What a file in the format of measurement files says of itself in `# key=value` lines, beside its table.

use super::assignment::Assignment;
use super::table::Table;
use crate::column::Column;
use crate::keys::is_key;
use crate::parse::set_key;
use crate::wholeness::Wholeness;
use crate::{Keys, Row};

/// What a program that saves a table may append to a comment: empty cells.
const EMPTY_CELLS: [char; 3] = [',', ';', '\t'];

/// A text's keys, and whether it has its end.
#[derive(Default)]
pub(super) struct Own {
    keys: Keys,
    /// Sentences about keys that cannot be kept.
    told: Vec<String>,
    wholeness: Wholeness,
}

impl Own {
    /// Reads the keys of a text; with them the text without a last line that breaks off.
    pub(super) fn read(text: &str) -> (Self, &str) {
        let (mut own, mut end) = (Self::default(), 0);
        for (number, line) in (1..).zip(text.split_inclusive('\n')) {
            if own.wholeness.is_cut_off(line.ends_with('\n')) {
                break;
            }
            end += line.len();
            let comment = line.trim_end().trim_end_matches(EMPTY_CELLS);
            if let Some((key, value)) = comment.strip_prefix('#').and_then(|c| c.split_once('=')) {
                own.take(key.trim(), value.trim(), number);
            }
        }
        (own, &text[..end])
    }

    fn take(&mut self, key: &str, value: &str, line: usize) {
        if !is_key(key) || self.wholeness.takes(key, value) {
            return;
        }
        if let Err(complaint) = set_key(&mut self.keys, key, value) {
            let message = complaint.message;
            self.told
                .push(format!("line {line} is left out: {message}"));
        }
    }

    /// The keys of a table of so many rows in columns of these names, and what is to be told of them; none of a table in another
    /// format, where comments may mean anything.
    pub(super) fn of_table(mut self, names: &[String], rows: usize) -> (Keys, Vec<String>) {
        let are_known = names.iter().all(|name| Column::from_name(name).is_some());
        if !are_known && !self.wholeness.is_promised() {
            return (Keys::default(), Vec::new());
        }
        if let Some(flaw) = self.wholeness.flaw(rows) {
            self.keys.set("partial", &flaw);
        }
        if let Some(why) = self.keys.get("partial") {
            let told = format!("this file is not whole, and what is made of it says so: {why}");
            self.told.push(told);
        }
        (self.keys, self.told)
    }
}

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
    let is_drive = |column| matches!(column, Column::VoltageOfAll | Column::Voltage(_));
    let is_current = |column| matches!(column, Column::CurrentOfEach | Column::Current(_));
    let is_time = |column| column == Column::Time;
    let is_displacement = |column| column == Column::Displacement;
    let holds = |key: &str| match key {
        // Of means it is another one.
        "noise_z_nm" => !are_means && are_kept(is_displacement),
        "noise_I_uA" | "noise_I_ratio" => !are_means && are_kept(is_current),
        "noise_V_mV" => are_kept(is_drive),
        "drive" | "prehold_V" | "prehold_s" => {
            settled.is_none() && are_kept(is_time) && are_kept(is_drive)
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
