//! What to type where headings do not say which column is which quantity.

use super::assignment::Assignment;
use super::error::ImportError;
use super::heading::Heading;
use super::table::Table;
use crate::ACTUATORS;
use crate::column::Column;

/// That one quantity is there more than once: how to say which is which of all such, by the columns' numbers.
pub(super) fn twice(table: &Table, assignments: &[Assignment], column: Column) -> ImportError {
    let of = |column: Column| assignments.iter().filter(move |a| a.column == column);
    let sources = |column: Column| -> Vec<usize> { of(column).map(|a| a.source).collect() };
    let listed: Vec<String> = of(column)
        .map(|a| format!("{} '{}'", a.source + 1, table.names[a.source]))
        .collect();
    let quantity = of(column).next().map_or("", Assignment::quantity);
    let mut asked: Vec<Column> = Vec::new();
    for a in assignments {
        if sources(a.column).len() > 1 && !asked.contains(&a.column) {
            asked.push(a.column);
        }
    }
    let said = asked
        .iter()
        .map(|&column| options(column, &sources(column)));
    ImportError::new(
        format!("the columns {} would all be {quantity}", listed.join(", ")),
        format!(
            "say by their numbers which is which: {}",
            said.collect::<Vec<_>>().join(" ")
        ),
    )
}

/// That one column is said to be two quantities.
pub(super) fn both(table: &Table, one: &Assignment, other: &Assignment) -> ImportError {
    ImportError::new(
        format!(
            "column {} '{}' cannot be both {} and {}",
            one.source + 1,
            table.names[one.source],
            one.quantity(),
            other.quantity()
        ),
        format!(
            "say for one of them another column, --column {}=NUMBER, where columns count from 1",
            other.quantity()
        ),
    )
}

/// That no column is a voltage: how to say which is, of those whose headings have a unit of it.
pub(super) fn no_voltage(table: &Table) -> ImportError {
    let is_voltage = |name: &String| {
        let unit = Heading::read(name).known_unit();
        unit.is_some_and(|unit| unit.is_of(Column::VoltageOfAll))
    };
    let columns = (0..table.names.len()).filter(|&source| is_voltage(&table.names[source]));
    let sources: Vec<usize> = columns.collect();
    let help = match sources.len() {
        0 => "say which column drives all actuators, --column V=NUMBER, or one of them, --column V1=NUMBER, where columns count from 1; \
              a unit other than V goes behind it, --column V=NUMBER:mV"
            .to_owned(),
        1..=ACTUATORS => format!(
            "say which drives what: {}{}",
            one_of_all(&sources),
            options(Column::VoltageOfAll, &sources)
        ),
        _ => {
            let numbers: Vec<String> = sources.iter().map(|s| (s + 1).to_string()).collect();
            format!(
                "in volts are the columns {}; say which drives what, for each actuator like --column V1={}",
                numbers.join(", "),
                numbers[0]
            )
        }
    };
    ImportError::new(
        format!(
            "none of the columns {} is known to be a voltage",
            table.names.join(", ")
        ),
        help,
    )
}

/// What rows need, and what was noticed of them on the way.
pub(super) fn of_few_rows(notes: &[String]) -> String {
    let need = "a row needs a number for the drive, and for the time where there is one";
    [&[need.to_owned()], notes].concat().join("; ")
}

/// How to say that one of these drives all actuators, where there are several and fewer than actuators: one may be what was set, another what
/// was measured of it.
fn one_of_all(sources: &[usize]) -> String {
    if !(2..ACTUATORS).contains(&sources.len()) {
        return String::new();
    }
    let numbers = sources
        .iter()
        .map(|source| format!("--column V={}", source + 1));
    let numbers: Vec<String> = numbers.collect();
    format!(
        "where one drives all four actuators, as the measured one beside the set one does, {}; where each drives its own, ",
        numbers.join(" or ")
    )
}

/// As many options as columns can be told apart: of voltages and currents one an actuator, of others the first.
fn options(column: Column, sources: &[usize]) -> String {
    let each = match column {
        Column::VoltageOfAll => Some("V"),
        Column::CurrentOfEach => Some("I"),
        _ => None,
    };
    let several = each.filter(|_| (2..=ACTUATORS).contains(&sources.len()));
    if let Some(letter) = several {
        let option = |(index, source): (usize, &usize)| {
            format!("--column {letter}{}={}", index + 1, source + 1)
        };
        let options: Vec<String> = sources.iter().enumerate().map(option).collect();
        return options.join(" ");
    }
    let known = crate::column::COLUMNS.iter().find(|(_, c)| *c == column);
    let quantity = each.or(known.map(|(name, _)| *name)).unwrap_or_default();
    format!("--column {quantity}={}", sources[0] + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{guesses, import, with_guesses};
    use miette::Diagnostic;

    #[test]
    fn a_column_is_one_quantity() {
        let table = Table::read(b"t;V;z\n0;0;0\n1;1;18\n").expect("a table");
        let said = ["V=2", "z=2"].map(|text| Assignment::parse(text, &table).expect(text));
        let error = import(&table, &said, false).expect_err("two quantities");
        let told = "column 2 'V' cannot be both V_V and z_um";
        assert_eq!(error.to_string(), told);
    }

    /// What is advised for these headings works as it is typed.
    fn advised(headings: &str) -> String {
        let width = headings.split(';').count();
        let row = |number: usize| vec![number.to_string(); width].join(";");
        let text = format!("{headings}\n{}\n{}\n{}\n", row(1), row(2), row(3));
        let table = Table::read(text.as_bytes()).expect("a table");
        let error = import(&table, &guesses(&table), false).expect_err("not told");
        let help = error.help().expect("what to do").to_string();
        for choice in help.split([';', ',']).flat_map(|one| one.split(" or ")) {
            let words: Vec<&str> = choice.split_whitespace().collect();
            let said = words.windows(2).filter(|pair| pair[0] == "--column");
            let said: Vec<Assignment> = said
                .map(|pair| Assignment::parse(pair[1], &table).expect(pair[1]))
                .collect();
            if !said.is_empty() {
                let all = with_guesses(&said, &table);
                import(&table, &all, false).expect("a measurement");
            }
        }
        help
    }

    #[test]
    fn advice_works_as_it_is_typed() {
        for (headings, options) in [
            (
                "s;V;V;V;V;um;mA;mA;mA;mA",
                "--column V1=2 --column V2=3 --column V3=4 --column V4=5 --column I1=7 --column I2=8 --column I3=9 --column I4=10",
            ),
            ("V;z;z", "--column z_um=2"),
            ("V1;V1", "--column V1_V=1"),
            ("s;CH1 (V);CH2 (V);Höhe [µm]", "--column V1=2 --column V2=3"),
            ("x;y [mV]", "--column V=2"),
            (
                "s;V set (V);V meas (V);um",
                "as the measured one beside the set one does, --column V=2 or --column V=3; where each drives its own, --column V1=2 --column V2=3",
            ),
        ] {
            let help = advised(headings);
            assert!(help.ends_with(options), "{headings}: {help}");
        }
    }
}
