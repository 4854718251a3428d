//! Tables of which drives are known, and nothing that was measured.

use super::assignment::Assignment;
use super::error::ImportError;
use super::guesses::rises;
use super::heading::Heading;
use super::table::Table;
use super::unit::Unit;
use crate::column::Column;

/// That a table's headings name no reading, though columns may be one. Who says what columns are is asked nothing.
pub(super) fn check(table: &Table, assignments: &[Assignment]) -> Result<(), ImportError> {
    let is_condition =
        |column| matches!(column, Column::Time | Column::GlobalTime | Column::Ambient);
    let is_reading = |a: &Assignment| !a.column.is_drive() && !is_condition(a.column);
    if assignments.iter().any(|a| is_reading(a) || a.is_said()) {
        return Ok(());
    }
    let may_be = |source: &usize| {
        let is_taken = assignments.iter().any(|a| a.source == *source);
        let holds_numbers = table.rows.iter().any(|row| row[*source].is_some());
        !is_taken && holds_numbers && !is_something_else(table, *source)
    };
    let sources: Vec<usize> = (0..table.names.len()).filter(may_be).collect();
    let of_rates = |source: &usize| is_rate(&table.names[*source]);
    let (rates, sources): (Vec<usize>, Vec<usize>) = sources.into_iter().partition(of_rates);
    let names = |sources: &[usize]| {
        let name = |source: &usize| format!("{} '{}'", source + 1, table.names[*source]);
        sources.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let drive = assignments.iter().find(|a| a.column.is_drive());
    let drives = drive.map_or_else(String::new, |drive| {
        let quantity = drive.quantity().trim_end_matches("_V");
        format!(
            "; where drives alone are meant, --column {quantity}={}",
            drive.source + 1
        )
    });
    let Some(first) = sources.first() else {
        return match &rates[..] {
            [] => Ok(()),
            rates => Err(ImportError::new(
                format!(
                    "no heading names anything that was measured: {} is by its unit a rate, as a velocity, and no displacement",
                    names(rates)
                ),
                format!(
                    "record the displacement itself, for which a vibrometer has an output of its own{drives}"
                ),
            )),
        };
    };
    let stated = unit(table, *first);
    let readings = [
        ("the displacement", "z", Column::Displacement, "um"),
        (
            "the current of each actuator",
            "I",
            Column::CurrentOfEach,
            "mA",
        ),
    ];
    let options = readings
        .into_iter()
        .filter_map(|(name, quantity, column, of)| {
            let number = first + 1;
            match stated {
                None => Some(format!("{name}, --column {quantity}={number}:{of}")),
                Some(unit) if unit.is_of(column) => {
                    Some(format!("{name}, --column {quantity}={number}"))
                }
                Some(_) => None,
            }
        });
    let options = options.collect::<Vec<_>>().join(", or ");
    Err(ImportError::new(
        format!(
            "no heading names anything that was measured; columns that may be it are {}",
            names(&sources)
        ),
        format!("say which is {options}{drives}"),
    ))
}

/// The unit that a column's heading states.
fn unit(table: &Table, source: usize) -> Option<Unit> {
    Heading::read(&table.names[source]).known_unit()
}

/// Whether a heading's unit is one of something a second.
fn is_rate(heading: &str) -> bool {
    let per_second = |unit: &str| unit.ends_with("/s");
    Heading::read(heading).unit.is_some_and(per_second)
}

/// Whether a column is in a unit of something else, or counts rows.
fn is_something_else(table: &Table, source: usize) -> bool {
    let is_of_another = unit(table, source).is_some_and(|unit| {
        !unit.is_of(Column::Displacement) && !unit.is_of(Column::CurrentOfEach)
    });
    let is_whole = |row: &Vec<Option<f64>>| row[source].is_none_or(|number| number.fract() == 0.0);
    is_of_another || rises(table, source) && table.rows.iter().all(is_whole)
}

#[cfg(test)]
mod tests {
    use super::super::{Assignment, Table, guesses, import, with_guesses};
    use miette::Diagnostic;

    #[test]
    fn a_velocity_is_no_displacement() {
        let table = Table::read(b"Time [s];Velocity [mm/s];Voltage [V]\n0;0;0\n1;0.6;1\n2;0.9;2\n");
        let table = table.expect("a table");
        let refused = import(&table, &guesses(&table), false).expect_err("nothing measured");
        let said = refused.to_string();
        assert!(
            said.contains("2 'Velocity [mm/s]' is by its unit a rate"),
            "{said}"
        );
        let help = refused.help().expect("what to do").to_string();
        assert!(
            !help.contains("--column z") && help.ends_with("--column V=3"),
            "{help}"
        );
    }

    #[test]
    fn a_table_of_drives_alone_is_asked_for_its_readings() {
        let table = Table::read(b"No;V;Sensor\n1;0;0.5\n2;1;18\n3;2;62\n").expect("a table");
        let asked = import(&table, &guesses(&table), false).expect_err("nothing measured");
        assert!(
            asked.to_string().ends_with("may be it are 3 'Sensor'"),
            "{asked}"
        );
        let help = asked.help().expect("what to do").to_string();
        for said in ["z=3:um", "I=3:mA", "V=2"] {
            assert!(help.contains(&format!("--column {said}")), "{help}");
            let said = Assignment::parse(said, &table).expect("a column");
            import(&table, &with_guesses(&[said], &table), false).expect("a measurement");
        }
    }
}
