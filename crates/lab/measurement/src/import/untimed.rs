//! Tables without a time, whose rows are taken for settled readings.

use super::assignment::Assignment;
use super::guesses::rises;
use super::heading::Heading;
use super::table::Table;
use crate::Row;
use crate::column::Column;

/// Settled readings at one drive are apart by less than this part of their range in the file: a choice, above what friction and creep
/// leave between them.
const APART: f64 = 0.2;

/// That rows are taken for settled readings, where columns are left out: one of them may be the time.
pub(super) fn taken(table: &Table, assignments: &[Assignment]) -> Option<String> {
    let is_left_out = |source: &usize| !assignments.iter().any(|a| a.source == *source);
    let mut left_out = (0..table.names.len()).filter(is_left_out).peekable();
    left_out.peek()?;
    let unit = |source: usize| Heading::read(&table.names[source]).known_unit();
    let may_be = |source: &usize| unit(*source).is_none_or(|unit| unit.is_of(Column::Time));
    let sources: Vec<usize> = left_out.filter(may_be).collect();
    let rising = sources.iter().find(|&&source| rises(table, source));
    let which = match rising.or(sources.first()) {
        None => String::new(),
        Some(&source) => {
            let which = match rising {
                Some(_) => format!(
                    "if '{}', which rises from row to row and is left out, is the time, say so",
                    table.names[source]
                ),
                None => "if a column that is left out is the time, say which".to_owned(),
            };
            let unit = unit(source).map_or(":s", |_| "");
            format!(": {which}, like --column t={}{unit}", source + 1)
        }
    };
    Some(format!(
        "no column is a time, so each row is taken for a settled reading{which}"
    ))
}

/// That rows one after the other at one drive are far apart, and no settled readings.
pub(super) fn apart(rows: &[Row]) -> Option<String> {
    let range = |rows: &[Row]| {
        let read = rows.iter().filter_map(|row| row.z_um);
        let (least, most) = read.fold((f64::MAX, f64::MIN), |(least, most), z| {
            (least.min(z), most.max(z))
        });
        (least <= most).then_some((least, most))
    };
    let (least, most) = range(rows)?;
    let held = rows.chunk_by(|a, b| a.voltage_v == b.voltage_v);
    let spreads = held.filter_map(|held| Some((held[0].highest_v(), range(held)?)));
    let (highest, (from, to)) =
        spreads.max_by(|(_, a), (_, b)| (a.1 - a.0).total_cmp(&(b.1 - b.0)))?;
    (to - from > APART * (most - least)).then(|| {
        format!(
            "rows at {highest} V, one after the other, read from {from} to {to} um: those are no settled readings; if they were sampled in \
             time, say which column tells it, and if there is none, keep those of the end"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Table, guesses, import};

    fn notes(text: &str) -> String {
        let table = Table::read(text.as_bytes()).expect("a table");
        let made = import(&table, &guesses(&table), false).expect("a measurement");
        made.notes.join("\n")
    }

    #[test]
    fn what_may_be_the_time_is_told() {
        let rising = notes("No;Tick;V;z\n5;0;0;0\n5;1;1;18\n5;2;2;62\n");
        assert!(
            rising.contains("if 'Tick', which rises from row to row"),
            "{rising}"
        );
        assert!(rising.ends_with("--column t=2:s"), "{rising}");
    }

    #[test]
    fn a_transient_without_times_is_told() {
        let transient = notes("V;z\n0;0\n2;0\n2;24\n2;42\n2;52\n");
        assert!(
            transient.contains("rows at 2 V, one after the other, read from 0 to 52 um"),
            "{transient}"
        );
        let settled = notes("V;z\n0;0\n2;60\n2;62\n3;120\n2;64\n");
        assert!(!settled.contains("no settled readings"), "{settled}");
    }
}
