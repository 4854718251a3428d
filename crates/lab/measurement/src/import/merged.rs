//! Headings over several columns, as merged cells leave them: a name, and nothing in the cells right of it.

use std::borrow::Cow;
use std::ops::Range;

use super::heading::Heading;
use super::quantity;
use crate::column::Column;

/// Gives the name of a drive or a current to the columns right of it that have none and hold numbers. Where one of the lines
/// numbers the actuators there, and holds no other numbers, each column gets its own; then that line's place is returned, too.
pub(super) fn spread(
    names: Vec<String>,
    lines: &[Option<Vec<Cow<'_, str>>>],
    is_number: impl Fn(&str) -> bool,
    holds_numbers: impl Fn(usize) -> bool,
) -> (Vec<String>, Option<usize>) {
    let spans = spans(&names, holds_numbers);
    if spans.is_empty() {
        return (names, None);
    }
    let is_within = |column: usize| spans.iter().any(|span| span.contains(&column));
    let of_line = |cells: &Vec<Cow<'_, str>>| -> Option<Vec<String>> {
        let named = cells.iter().enumerate().map(|(column, cell)| {
            let name = &names[column];
            match spans.iter().find(|span| span.contains(&column)) {
                Some(span) => numbered(&names[span.start], cell),
                None if is_number(cell) => None,
                None if name.is_empty() => Some(cell.to_string()),
                None => Some(name.clone()),
            }
        });
        named.collect()
    };
    let mut numbering = lines.iter().enumerate();
    let found = numbering.find_map(|(at, line)| Some((of_line(line.as_ref()?)?, Some(at))));
    found.unwrap_or_else(|| {
        let mut last = "";
        let each = names.iter().enumerate().map(|(column, name)| {
            match is_within(column) && name.is_empty() {
                true => last.to_owned(),
                false => {
                    last = name;
                    name.clone()
                }
            }
        });
        (each.collect(), None)
    })
}

/// Columns under one name, two or more.
fn spans(names: &[String], holds_numbers: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let is_of_all = |name: &str| {
        let column = quantity::named(Heading::read(name).quantity);
        matches!(column, Some(Column::VoltageOfAll | Column::CurrentOfEach))
    };
    let starts = (0..names.len()).filter(|&start| is_of_all(&names[start]));
    let span = |start: usize| {
        let right = start + 1..names.len();
        let bare = right.take_while(|&at| names[at].is_empty() && holds_numbers(at));
        start..start + 1 + bare.count()
    };
    starts.map(span).filter(|span| span.len() > 1).collect()
}

/// The name of one actuator's column, `Drive ch2 (V)` of `Drive (V)` and `ch2`.
fn numbered(name: &str, number: &str) -> Option<String> {
    let Heading { quantity, unit } = Heading::read(name);
    let named = format!("{quantity} {number}");
    matches!(
        quantity::named(&named)?,
        Column::Voltage(_) | Column::Current(_)
    )
    .then(|| match unit {
        Some(unit) => format!("{named} ({unit})"),
        None => named,
    })
}

#[cfg(test)]
mod tests {
    use super::super::Table;
    use super::super::{guesses, import};

    fn names(text: &str) -> Vec<String> {
        Table::read(text.as_bytes()).expect("a table").names
    }

    #[test]
    fn a_merged_name_stands_for_the_columns_right_of_it() {
        let rows = "0,0,0,0,0,0,\n1,1,2,3,3.5,70,\n";
        let merged = format!("t (s),Drive (V),,,,z (um),\n{rows}");
        let names = names(&merged);
        assert_eq!(names[1..5], ["Drive (V)"; 4]);
        assert_eq!(names[6], "", "a column without numbers has no name");
        let table = Table::read(merged.as_bytes()).expect("a table");
        let asked = import(&table, &guesses(&table), false).expect_err("four drives of all");
        let help = miette::Diagnostic::help(&asked).expect("what to do");
        assert!(
            help.to_string()
                .ends_with("--column V1=2 --column V2=3 --column V3=4 --column V4=5"),
            "{help}"
        );
    }

    #[test]
    fn a_line_of_actuators_below_a_merged_name_tells_them_apart() {
        let rows = "0,0,0,0,0\n1,1,2,3,3.5\n2,1,2,3,3.5\n";
        for (headings, last) in [
            ("t (s),Drive (V),,,\n,4,3,2,1\n", "Drive 1 (V)"),
            ("t (s),Drive (V),,,\n,ch4,ch3,ch2,ch1\n", "Drive ch1 (V)"),
            ("Time,U,,,\nt (s),4,3,2,1\n", "U 1"),
        ] {
            let text = format!("{headings}{rows}");
            let table = Table::read(text.as_bytes()).expect("a table");
            assert_eq!(table.names[4], last);
            let made = import(&table, &guesses(&table), false).expect("a measurement");
            assert_eq!(made.file.rows.len(), 3, "{headings}");
            assert_eq!(made.file.rows[1].voltage_v, [3.5, 3.0, 2.0, 1.0]);
        }
        // Drives that happen to be numbers of actuators.
        let driven = names("V (V),,,,z (um)\n1,2,3,4,50\n0,0,0,0,0\n");
        assert_eq!(driven[..4], ["V (V)"; 4]);
    }
}
