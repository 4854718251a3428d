//! Times that count from an epoch: Unix's, 1970, or LabVIEW's, 1904.

use crate::Row;

/// An epoch is longer ago than any measurement lasts (s): until 2001 a billion of seconds had gone since Unix's, which began 66 years after
/// LabVIEW's.
const LEAST_S: f64 = 1e9;

/// Whether all times are so late that they can only count from one.
pub(super) fn is_since_one(rows: &[Row]) -> bool {
    !rows.is_empty() && rows.iter().all(|row| row.t_s >= LEAST_S)
}

#[cfg(test)]
mod tests {
    use super::super::{Table, guesses, import};

    #[test]
    fn times_since_an_epoch_count_from_the_first_row() {
        for (heading, first) in [
            ("Timestamp", "17640000"),
            ("Time", "38470000"),
            ("Time (ms)", "17640000000"),
        ] {
            let text = format!("{heading},V,z\n{first}00,0,0\n{first}01.5,1,18\n{first}03,2,62\n");
            let table = Table::read(text.as_bytes()).expect("a table");
            let made = import(&table, &guesses(&table), false).expect("a measurement");
            let unit_s = if heading.contains("ms") { 1e-3 } else { 1.0 };
            let last_s = made.file.rows[2].t_s;
            assert!((last_s - 3.0 * unit_s).abs() < 1e-6, "{heading}: {last_s}");
            assert!(
                made.notes
                    .iter()
                    .any(|note| note.contains("count from the first row"))
            );
        }
    }
}
