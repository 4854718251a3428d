//! What stands above a column: its quantity and its unit.

use super::error::ImportError;
use super::quantity;
use super::unit::Unit;

/// A heading in its parts.
#[derive(Debug, PartialEq)]
pub(super) struct Heading<'h> {
    pub(super) quantity: &'h str,
    /// What stands where a unit does.
    pub(super) unit: Option<&'h str>,
}

impl<'h> Heading<'h> {
    /// Of `Voltage (mV)`, `I [mA]`, `t/s` or `height_nm`; of a unit alone, that is both.
    pub(super) fn read(heading: &'h str) -> Self {
        let heading = heading.trim();
        let (quantity, unit) = parts(heading).unwrap_or_else(|| {
            let alone = Unit::read(heading).map(|_| heading);
            (heading, alone)
        });
        Self { quantity, unit }
    }

    /// The unit that it states, where that is one that is read.
    pub(super) fn known_unit(&self) -> Option<Unit> {
        self.unit.and_then(Unit::read)
    }

    /// Whether it is nothing but a unit.
    pub(super) fn is_bare_unit(&self) -> bool {
        self.unit == Some(self.quantity)
    }
}

/// Headings of a table from the lines above it, the nearest first: one line, or names above units. A unit goes behind its name
/// in brackets, and a name stands for the columns right of it that have none, as a merged cell does.
pub(super) fn headings<S: AsRef<str>>(nearest: &[S], above: Option<&[S]>) -> Vec<String> {
    let units = texts(nearest);
    let Some(names) = above.map(texts).filter(|names| are_names(names, &units)) else {
        return units;
    };
    let mut last = String::new();
    let both = names.into_iter().zip(units).map(|(name, unit)| {
        if !name.is_empty() {
            last.clone_from(&name);
        }
        match Unit::read(&unit) {
            _ if unit.is_empty() => name,
            Some(_) if has_unit(&last) => last.clone(),
            Some(_) => format!("{last} ({})", unit.trim_matches(['(', ')', '[', ']'])),
            None => format!("{last} {unit}"),
        }
    });
    both.collect()
}

/// That a unit beneath a name is another one than the name has.
pub(super) fn contradiction<S: AsRef<str>>(
    nearest: &[S],
    above: Option<&[S]>,
) -> Option<ImportError> {
    let units = texts(nearest);
    let names = above.map(texts).filter(|names| are_names(names, &units))?;
    let is_other = |(_, (name, below)): &(usize, (&String, &String))| {
        if !has_unit(name) {
            return false;
        }
        let units = Heading::read(name).known_unit();
        let units = units.zip(Unit::read(below));
        units.is_some_and(|(unit, below)| unit.per(below) != Some(1.0))
    };
    let mut columns = names.iter().zip(&units).enumerate();
    let (column, (name, below)) = columns.find(is_other)?;
    Some(ImportError::new(
        format!(
            "column {} is headed '{name}', and '{below}' stands beneath",
            column + 1
        ),
        "delete the unit that its numbers are not in, here and in the other columns",
    ))
}

/// Whether a name says its unit. `V` above a unit is the voltage's name.
fn has_unit(name: &str) -> bool {
    !name.eq_ignore_ascii_case("V") && Heading::read(name).unit.is_some()
}

/// Cells without blanks around them.
fn texts<S: AsRef<str>>(cells: &[S]) -> Vec<String> {
    let trimmed = cells.iter().map(|cell| cell.as_ref().trim().to_owned());
    trimmed.collect()
}

/// Whether the line below has a unit in each of its cells, in some nothing else, and the line above names for these.
fn are_names(names: &[String], units: &[String]) -> bool {
    let filled = |cells: &[String]| cells.iter().filter(|cell| !cell.is_empty()).count();
    let has_unit = |cell: &&String| Heading::read(cell).known_unit().is_some();
    let first_bare = units.iter().position(|cell| Unit::read(cell).is_some());
    let is_under_a_name =
        first_bare.is_some_and(|first| names[..=first].iter().any(|name| !name.is_empty()));
    let said = units.iter().filter(|cell| !cell.is_empty());
    is_under_a_name && filled(names) >= 2 && said.clone().filter(has_unit).count() == said.count()
}

fn parts(heading: &str) -> Option<(&str, Option<&str>)> {
    for (open, close) in [('(', ')'), ('[', ']')] {
        let inside = heading.strip_suffix(close);
        if let Some((before, unit)) = inside.and_then(|inside| inside.rsplit_once(open))
            && !before.trim().is_empty()
        {
            return Some((before.trim(), Some(unit)));
        }
    }
    // What is no unit may be another word of the name: `Date/Time`.
    let is_name =
        |after: &str| Unit::read(after).is_none() && quantity::in_other_words(heading).is_some();
    if let Some((before, unit)) = heading.split_once('/').filter(|(_, after)| !is_name(after)) {
        return Some((before.trim(), Some(unit)));
    }
    if let Some(channel) = channel(heading) {
        return Some(channel);
    }
    let (before, unit) = heading.rsplit_once(['_', ' ', ','])?;
    let is_both = Unit::read(unit).is_some() && quantity::in_other_words(before).is_some();
    is_both.then(|| (before.trim_end_matches([' ', ',']), Some(unit)))
}

/// A channel and its unit, as Rigol writes them together: `CH1V`.
fn channel(heading: &str) -> Option<(&str, Option<&str>)> {
    let number = heading.strip_prefix("CH")?;
    let unit = number.trim_start_matches(|c: char| c.is_ascii_digit());
    let is_both = unit.len() < number.len() && Unit::read(unit).is_some();
    is_both.then(|| (heading[..heading.len() - unit.len()].trim(), Some(unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_above_units() {
        let lines = |above: &str, nearest: &str| {
            let cells = |line: &str| -> Vec<String> { line.split(',').map(String::from).collect() };
            headings(&cells(nearest), Some(&cells(above))).join(",")
        };
        for (above, nearest, both) in [
            (
                "Time,Voltage CH1,No",
                "us,[mV],",
                "Time (us),Voltage CH1 (mV),No",
            ),
            ("Time,U1 [V]", "s,V", "Time (s),U1 [V]"),
            (
                "Time,Voltage,,z",
                "s,CH1 (V),CH2 (V),um",
                "Time (s),Voltage CH1 (V),Voltage CH2 (V),z (um)",
            ),
            ("Mirror M7,,", "s,V,um", "s,V,um"),
            ("Operator,Jo,", "t,V,um", "t,V,um"),
            ("Operator,Jo,", "t (s),U (V),z (um)", "t (s),U (V),z (um)"),
        ] {
            assert_eq!(lines(above, nearest), both);
        }
    }

    #[test]
    fn a_unit_beneath_another_one_is_refused() {
        let refused = |above: &[&str], nearest: &[&str]| {
            contradiction(nearest, Some(above)).map(|error| error.to_string())
        };
        let told = "column 2 is headed 'V (V)', and 'mV' stands beneath";
        assert_eq!(
            refused(&["t (s)", "V (V)"], &["s", "mV"]).as_deref(),
            Some(told)
        );
        for units in [["s", "volts"], ["s", ""], ["sec", "[V]"]] {
            assert_eq!(refused(&["t (s)", "V (V)"], &units), None);
        }
        assert_eq!(refused(&["Time", "V"], &["s", "mV"]), None);
    }

    #[test]
    fn headings_have_a_quantity_and_a_unit() {
        for (heading, quantity, unit) in [
            ("Voltage (mV)", "Voltage", Some("mV")),
            ("Spannung 1 [V]", "Spannung 1", Some("V")),
            ("Voltage (set) [V]", "Voltage (set)", Some("V")),
            ("t/s", "t", Some("s")),
            ("CH2V", "CH2", Some("V")),
            ("CH2", "CH2", None),
            ("height_nm", "height", Some("nm")),
            ("T_ambient", "T_ambient", None),
            ("T_ambient_C", "T_ambient", Some("C")),
            ("mA", "mA", Some("mA")),
            ("[mA]", "[mA]", Some("[mA]")),
            ("Messwert", "Messwert", None),
        ] {
            assert_eq!(Heading::read(heading), Heading { quantity, unit });
        }
    }
}
