//! Numbers by which an instrument says that it read nothing.

use super::assignment::Assignment;
use super::table::Table;

/// Infinity is 9.9E37 and what is not a number 9.91E37 (SCPI-1999, volume 1, 7.2.1), of which single precision rounds the
/// eighth digit.
const LEAST: f64 = 9.8e37;

/// What loggers write for a reading that they lost: the value without data of Esri's ASCII raster, and with a digit more.
const LOST: [f64; 2] = [-9999.0, -99_999.0];

/// Whether a number is no reading, of whichever sign.
pub(super) fn is_one(number: f64) -> bool {
    number.abs() >= LEAST || LOST.contains(&number)
}

/// How many there are in the columns that are taken, a sentence each.
pub(super) fn sentences(table: &Table, assignments: &[Assignment]) -> Vec<String> {
    let sentence = |assignment: &Assignment| {
        let cells = table.rows.iter().filter_map(|row| row[assignment.source]);
        let found = cells.filter(|number| is_one(*number)).count();
        let readings = match found {
            0 => return None,
            1 => "1 reading".to_owned(),
            _ => format!("{found} readings"),
        };
        Some(format!(
            "{readings} of {} of -9999, or as large as 9.9E37 or infinite, by which an instrument says that it read nothing, count as missing",
            assignment.quantity()
        ))
    };
    assignments.iter().filter_map(sentence).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{guesses, import};

    #[test]
    fn what_an_instrument_could_not_read_is_missing_and_counted() {
        let text = "t,V,z,I\n0,0,0,0\n1,1,9.9E37,1e-3\n2,2,-9.9E+37,inf\n3,2,9.91e37,-Infinity\n4,9.8999998e37,5,2e-3\n5,2,NaN,2e-3\n6,3,-9999,4e-3\n";
        let table = Table::read(text.as_bytes()).expect("a table");
        let imported = import(&table, &guesses(&table), false).expect("a measurement");
        let z: Vec<_> = imported.file.rows.iter().map(|row| row.z_um).collect();
        assert_eq!(z, [Some(0.0), None, None, None, None, None]);
        let amperes: Vec<_> = imported
            .file
            .rows
            .iter()
            .map(|row| row.current_a[0])
            .collect();
        assert_eq!(
            amperes,
            [Some(0.0), Some(1e-3), None, None, Some(2e-3), Some(4e-3)]
        );
        for words in [
            "4 readings of z_um",
            "2 readings of I_A",
            "1 reading of V_V",
            "1 row without a time or a drive is left out",
        ] {
            let notes = &imported.notes;
            assert!(
                notes.iter().any(|note| note.contains(words)),
                "{words}: {notes:?}"
            );
        }
    }
}
