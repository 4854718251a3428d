//! Which column of a table is which quantity, in which unit.

use super::error::ImportError;
use super::heading::Heading;
use super::quantity;
use super::table::Table;
use super::unit::{self, Unit};
use crate::column::{COLUMNS, Column};

/// A column of a table as a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assignment {
    /// Which of the table's columns, from 0.
    pub source: usize,
    /// What it is.
    pub column: Column,
    /// The unit that its numbers are taken in; the measurement file's where none is known.
    unit: Option<Unit>,
    /// The unit that its heading states.
    stated: Option<Unit>,
    /// What numbers are multiplied with besides.
    times: f64,
    /// Whether a user says it.
    is_said: bool,
}

impl Assignment {
    /// What a heading says: that a column is this quantity, in this unit where it states one; `None` where that is of something else, as
    /// the column is then.
    pub(super) fn guessed(source: usize, column: Column, heading: &Heading<'_>) -> Option<Self> {
        let stated = heading.unit.map(Unit::read);
        if stated.is_some_and(|unit| unit.is_none_or(|unit| !unit.is_of(column))) {
            return None;
        }
        let stated = stated.flatten();
        Some(Self {
            source,
            column,
            unit: stated,
            stated,
            times: 1.0,
            is_said: false,
        })
    }

    /// Whether another one is of the same column, or says the same quantity, wholly or in part.
    pub(super) fn clashes(&self, other: &Self) -> bool {
        let is_part = self.column.of_all() == other.column || other.column.of_all() == self.column;
        self.source == other.source || self.column == other.column || is_part
    }

    /// What a user says: `QUANTITY=NAME`, `QUANTITY=NAME:UNIT` or `QUANTITY=NAME:UNIT:FACTOR`, as `z=height:nm:-1`. The name
    /// may be the column's number, counted from 1. Where no unit is said it is the one that the heading states.
    ///
    /// # Errors
    /// Where one of the parts is not known.
    pub fn parse(text: &str, table: &Table) -> Result<Self, ImportError> {
        let form = "write it like z=height:nm:-1: quantity, column, unit, factor";
        let (quantity, rest) = text
            .split_once('=')
            .ok_or_else(|| ImportError::new(format!("'{text}' assigns nothing"), form))?;
        let column = quantity::said(quantity.trim()).ok_or_else(|| {
            ImportError::new(
                format!("there is no quantity '{quantity}'"),
                "quantities are t, V or V1 to V4, I or I1 to I4, z, T_ambient, tilt_x, tilt_y, reference",
            )
        })?;
        let mut parts = rest.split(':').map(str::trim);
        let name = parts.next().unwrap_or_default();
        let source = place(name, table)?;
        let heading = Heading::read(&table.names[source]);
        let written = parts.next().filter(|unit| !unit.is_empty());
        let read = |text: &str| Unit::read(text).filter(|unit| unit.is_of(column));
        let stated = heading.unit.and_then(read);
        let unit = match written.or(heading.unit.filter(|_| !heading.is_bare_unit())) {
            Some(unit) => Some(read(unit).ok_or_else(|| {
                ImportError::new(
                    format!("'{unit}' is no unit of {quantity}"),
                    format!(
                        "{}; say it behind the column: {quantity}={name}:UNIT",
                        unit::CHOICE
                    ),
                )
            })?),
            None => stated,
        };
        let times: f64 = match parts.next() {
            Some(factor) => {
                let times = factor.parse().ok();
                let times = times.filter(|times: &f64| times.is_finite() && *times != 0.0);
                times
                    .ok_or_else(|| ImportError::new(format!("'{factor}' is not a factor"), form))?
            }
            None => 1.0,
        };
        Ok(Self {
            source,
            column,
            unit,
            stated,
            times,
            is_said: true,
        })
    }

    /// Whether it is guessed of a heading that says a temperature, and not what has it.
    pub(super) fn is_of_anything(&self, table: &Table) -> bool {
        let heading = Heading::read(&table.names[self.source]);
        !self.is_said && quantity::is_of_anything(heading.quantity)
    }

    /// Whether a user says it.
    pub(super) fn is_said(&self) -> bool {
        self.is_said
    }

    /// Whether its heading or a user says its unit.
    pub(super) fn has_unit(&self) -> bool {
        self.unit.is_some()
    }

    /// Whether a user says what its numbers are multiplied with.
    pub(super) fn has_factor(&self) -> bool {
        self.times != 1.0
    }

    /// A number of the table in the unit of the measurement file.
    pub(super) fn value(&self, number: f64) -> f64 {
        self.factor() * (number + self.added())
    }

    /// Whether its numbers are taken as they are, but for their sign.
    pub(super) fn is_plain(&self) -> bool {
        self.factor().abs() == 1.0 && self.added() == 0.0
    }

    fn factor(&self) -> f64 {
        self.times * self.unit.map_or(1.0, |unit| unit.factor)
    }

    fn added(&self) -> f64 {
        self.unit.map_or(0.0, |unit| unit.added)
    }

    /// The name of the quantity in measurement files.
    pub fn quantity(&self) -> &'static str {
        let mut columns = COLUMNS.iter();
        columns
            .find(|(_, column)| *column == self.column)
            .map_or("", |(name, _)| name)
    }

    /// What is done to the numbers, in words, and what the heading has to do with it; empty where nothing is done.
    pub fn conversion(&self) -> String {
        let added = match self.added() {
            0.0 => String::new(),
            added => format!("{added:+}, "),
        };
        let is_plain = self.factor() == 1.0 && added.is_empty();
        let done = match is_plain {
            true => String::new(),
            false => format!("{added}times {}", self.factor()),
        };
        match self.stated {
            Some(stated) if self.unit != self.stated => {
                format!("{done}, though its heading says {}", stated.name)
            }
            Some(stated) if !is_plain => format!("{done}, as its heading says {}", stated.name),
            _ => done,
        }
    }
}

/// The column of this number or name.
fn place(name: &str, table: &Table) -> Result<usize, ImportError> {
    let number = name.parse().ok();
    if let Some(number) = number.filter(|number| (1..=table.names.len()).contains(number)) {
        return Ok(number - 1);
    }
    let places = |is_it: &dyn Fn(&String) -> bool| -> Vec<usize> {
        let names = table.names.iter().enumerate();
        names
            .filter(|(_, known)| is_it(known))
            .map(|(place, _)| place)
            .collect()
    };
    let mut found = places(&|known| known == name);
    if found.is_empty() {
        found =
            places(&|known| quantity::key(Heading::read(known).quantity) == quantity::key(name));
    }
    match found[..] {
        [source] => Ok(source),
        [] => Err(ImportError::new(
            format!("the table has no column '{name}'"),
            format!("its columns are {}", table.names.join(", ")),
        )),
        [..] => {
            let numbers: Vec<String> = found.iter().map(|place| (place + 1).to_string()).collect();
            Err(ImportError::new(
                format!("{} columns are called '{name}'", found.len()),
                format!(
                    "say which one by its number for its name: {}",
                    numbers.join(", ")
                ),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(heading: &str) -> Table {
        Table::read(format!("{heading}\n0;0;0\n1;2;3\n2;3;4\n").as_bytes()).expect("a table")
    }

    #[test]
    fn a_column_that_a_user_maps_has_the_unit_of_its_heading() {
        for (heading, text, factor, words) in [
            (
                "x;V;mA",
                "I1=3",
                1e-3,
                "times 0.001, as its heading says mA",
            ),
            (
                "x;V;Sensor [nm]",
                "z=3",
                1e-3,
                "times 0.001, as its heading says nm",
            ),
            (
                "x;V;Sensor [nm]",
                "z=Sensor:mm",
                1e3,
                "times 1000, though its heading says nm",
            ),
            ("x;V;Sensor (set) (um)", "z=sensor (set)", 1.0, ""),
            ("x;V;h", "z=h", 1.0, ""),
        ] {
            let said = Assignment::parse(text, &table(heading)).expect(text);
            assert_eq!(
                (said.value(1.0), said.conversion().as_str()),
                (factor, words),
                "{text}"
            );
        }
        let unknown = Assignment::parse("z=3", &table("x;V;Sensor [inch]")).expect_err("inch");
        assert!(
            unknown.to_string().contains("'inch' is no unit of z"),
            "{unknown}"
        );
    }
}
