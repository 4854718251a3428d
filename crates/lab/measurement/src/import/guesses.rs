//! What headings say, and where they do not say it in so many words, columns.

use super::assignment::Assignment;
use super::heading::Heading;
use super::kind::Kind;
use super::quantity;
use super::table::Table;
use crate::column::Column;

/// What a user says of columns, and of the others what their headings say. Where one actuator's column is said, a heading that
/// names all of them says nothing, and the other way round.
pub fn with_guesses(said: &[Assignment], table: &Table) -> Vec<Assignment> {
    let is_free = |guess: &Assignment| !said.iter().any(|a| a.clashes(guess));
    let guessed = guesses(table).into_iter().filter(is_free);
    said.iter().copied().chain(guessed).collect()
}

/// The quantities that the headings of a table's columns say, with their units: `Voltage (mV)`, `I [mA]`, `t/s`, `height_nm`. Where
/// none says one, the next best names do, and a column of times is the time.
pub fn guesses(table: &Table) -> Vec<Assignment> {
    let mut headings = table.names.iter().map(|name| bare(name));
    let is_from_0 =
        headings.any(|bare| bare.ends_with('0') && quantity::named_from(0, bare).is_some());
    let first = if is_from_0 { 0 } else { 1 };
    let by = |named: &dyn Fn(usize, &str) -> Option<Column>| -> Vec<Assignment> {
        let names = table.names.iter().enumerate();
        let guess = |(source, name): (usize, &String)| {
            Assignment::guessed(source, named(source, name)?, &Heading::read(name))
        };
        names.filter_map(guess).collect()
    };
    let mut guesses = by(&|_, name| quantity::named_from(first, bare(name)));
    // Where one temperature is the room's, another one is not.
    let is_room = |a: &Assignment| a.column == Column::Ambient && !a.is_of_anything(table);
    if guesses.iter().any(is_room) {
        guesses.retain(|a| a.column != Column::Ambient || is_room(a));
    }
    let in_other_words = by(&|source, name| {
        let column = quantity::in_other_words(bare(name))?;
        (column != Column::Time || is_filled(table, source)).then_some(column)
    });
    let numbered = by(&|_, name| quantity::numbered(bare(name)));
    let timed = by(&|source, name| is_time(table, source, name).then_some(Column::Time));
    for others in [in_other_words, numbered, timed] {
        let is_free = |other: &Assignment| !guesses.iter().any(|a| a.clashes(other));
        let mut free: Vec<Assignment> = others.into_iter().filter(is_free).collect();
        // Of several times, which each channel has, the first is everyone's.
        let time = free.iter().position(|a| a.column == Column::Time);
        let time = time.map(|at| free[at].source);
        free.retain(|a| a.column != Column::Time || Some(a.source) == time);
        guesses.extend(free);
    }
    guesses.sort_by_key(|guess| guess.source);
    guesses
}

/// The quantity of a heading. A unit in brackets and nothing else names its quantity without them.
fn bare(heading: &str) -> &str {
    let brackets = ['(', ')', '[', ']'];
    Heading::read(heading).quantity.trim_matches(brackets)
}

/// Whether most rows have a number in a column.
fn is_filled(table: &Table, source: usize) -> bool {
    let filled = table.rows.iter().filter(|row| row[source].is_some());
    2 * filled.count() > table.rows.len()
}

/// Whether a column of another name is a time: in a unit of times, or of dates or clock times, and rises.
fn is_time(table: &Table, source: usize, name: &str) -> bool {
    let unit = Heading::read(name).known_unit();
    let mut clocks = table.kinds.iter().filter(|one| one.kind == Kind::Clock);
    let is_of_times = unit.is_some_and(|unit| unit.is_of(Column::Time))
        || clocks.any(|clock| clock.column == source);
    is_of_times && is_filled(table, source) && rises(table, source)
}

/// Whether a column's numbers rise from row to row.
pub(super) fn rises(table: &Table, source: usize) -> bool {
    let numbers: Vec<f64> = table.rows.iter().filter_map(|row| row[source]).collect();
    numbers.len() > 1 && numbers.windows(2).all(|pair| pair[0] < pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quantities of a table with these headings, whose columns count from their number.
    fn guessed(headings: &str) -> Vec<Option<&'static str>> {
        let width = headings.split(';').count();
        let row = |n: usize| {
            (n..n + width)
                .map(|n| n.to_string())
                .collect::<Vec<_>>()
                .join(";")
        };
        let rows: Vec<String> = (0..4).map(row).collect();
        let table = Table::read(format!("{headings}\n{}\n", rows.join("\n")).as_bytes());
        let table = table.expect("a table");
        let all = guesses(&table);
        let of = |source| all.iter().find(|a| a.source == source);
        (0..width)
            .map(|source| of(source).map(Assignment::quantity))
            .collect()
    }

    #[test]
    fn times_have_many_names() {
        for time in [
            "Elapsed Time (s)",
            "elapsed_time_s",
            "Relative Time",
            "Second",
            "Seconds",
            "Time stamp [s]",
            "Time (msec)",
            "Time (usec)",
            "DateTime",
            "Date/Time",
            "Uhrzeit",
            "Time, ms",
            "X_Value",
            "x-axis (second)",
            "Messung [s]",
        ] {
            let guessed = guessed(&format!("{time};V (V);z (um)"));
            assert_eq!(guessed, [Some("t_s"), Some("V_V"), Some("z_um")], "{time}");
        }
        assert_eq!(
            guessed("Elapsed;Time since midnight (s);V")[..2],
            [Some("t_s"), None]
        );
        assert_eq!(guessed("No;Setting;V")[..2], [None, None]);
    }

    #[test]
    fn displacements_and_currents_have_other_names_too() {
        for z in [
            "z (microns)",
            "z (\u{c5})",
            "z1 (um)",
            "z avg (um)",
            "Disp",
            "Gap",
            "\u{394}z",
            "delta_z_um",
            "Weg in \u{b5}m",
            "Displacement (Micrometer)",
        ] {
            assert_eq!(
                guessed(&format!("V;{z}")),
                [Some("V_V"), Some("z_um")],
                "{z}"
            );
        }
        assert_eq!(guessed("V;I (mAmps)")[1], Some("I_A"));
        assert_eq!(
            guessed("V;z1;z2;z avg"),
            [Some("V_V"), None, None, Some("z_um")]
        );
        assert_eq!(guessed("V;z;z avg")[1..], [Some("z_um"), None]);
    }
}
