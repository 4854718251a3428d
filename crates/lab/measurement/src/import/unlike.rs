//! Columns whose cells are of another kind than their quantity.

use super::assignment::Assignment;
use super::error::ImportError;
use super::kind::{Kind, KindOfCells};
use super::table::Table;
use crate::column::Column;

/// That no cell of another kind is taken for a number of volts, micrometres or the like.
///
/// # Errors
/// Where a column that is no time holds times, or one holds parts of a hundred and nobody says of how much.
pub(super) fn check(table: &Table, assignments: &[Assignment]) -> Result<(), ImportError> {
    for assignment in assignments {
        let mut kinds = table.kinds.iter();
        let wrong = kinds.find(|one| {
            let is_wrong = match one.kind {
                Kind::Percent => !assignment.has_factor(),
                Kind::Clock | Kind::Duration => {
                    !matches!(assignment.column, Column::Time | Column::GlobalTime)
                }
            };
            one.column == assignment.source && is_wrong
        });
        if let Some(wrong) = wrong {
            return Err(refused(table, assignment, wrong));
        }
    }
    Ok(())
}

fn refused(table: &Table, assignment: &Assignment, wrong: &KindOfCells) -> ImportError {
    let KindOfCells {
        column, cell, line, ..
    } = wrong;
    let what = match wrong.kind {
        Kind::Percent => "parts of a hundred",
        Kind::Clock => "a date or a time",
        Kind::Duration => "a duration",
    };
    let quantity = assignment.quantity();
    let unit = quantity.rsplit('_').next().unwrap_or_default();
    let help = match wrong.kind {
        Kind::Percent => format!(
            "say how much one percent is, in {unit}: --column {quantity}={}:{unit}:0.035 where a hundred are 3.5 {unit}",
            column + 1
        ),
        Kind::Clock | Kind::Duration => {
            "a spreadsheet makes dates of numbers like 1.4: give the column the format of numbers, and type such cells anew".into()
        }
    };
    ImportError::new(
        format!(
            "column {} '{}' is {quantity}, and holds {what} in line {line}: {cell}",
            column + 1,
            table.names[*column]
        ),
        help,
    )
}

#[cfg(test)]
mod tests {
    use super::super::{Assignment, Table, guesses, import, with_guesses};

    fn refused(text: &str) -> String {
        let table = Table::read(text.as_bytes()).expect("a table");
        let refused = import(&table, &guesses(&table), false).expect_err(text);
        refused.to_string()
    }

    #[test]
    fn dates_and_durations_are_no_volts_or_micrometres() {
        for (cell, told) in [
            ("2026-05-03T00:00:00", "a date or a time"),
            ("00:01:02", "a date or a time"),
            ("PT62S", "a duration"),
        ] {
            let text = format!("t (s),V (V),z (um)\n0,0,0\n1,1,26\n2,2,{cell}\n3,3,160\n");
            let told = format!("column 3 'z (um)' is z_um, and holds {told} in line 4: {cell}");
            assert_eq!(refused(&text), told);
        }
    }

    #[test]
    fn a_drive_in_percent_is_asked_about() {
        let text = "t (s),Drive,z (um)\n0,0%,0\n1,50 %,26\n2,100 %,90\n";
        let told = refused(text);
        assert!(
            told.contains("holds parts of a hundred in line 2: 0%"),
            "{told}"
        );
        let table = Table::read(text.as_bytes()).expect("a table");
        let said = Assignment::parse("V_V=2:V:0.035", &table).expect("a column");
        let all = with_guesses(&[said], &table);
        let made = import(&table, &all, false).expect("a measurement");
        assert!((made.file.rows[1].voltage_v[0] - 1.75).abs() < 1e-9);
    }
}
