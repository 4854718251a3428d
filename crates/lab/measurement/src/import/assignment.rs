//! Which column of a table is which quantity, in which unit.

use super::error::ImportError;
use super::table::Table;
use crate::column::{COLUMNS, Column};

/// A column of a table as a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assignment {
    /// Which of the table's columns, from 0.
    pub source: usize,
    /// What it is.
    pub column: Column,
    /// What its numbers are multiplied with, after this is added to them.
    factor: f64,
    added: f64,
}

/// Names that people give to quantities, in lower case.
const NAMES: [(&str, Column); 42] = [
    ("t", Column::Time),
    ("t_s", Column::Time),
    ("time", Column::Time),
    ("zeit", Column::Time),
    ("elapsed", Column::Time),
    ("timestamp", Column::Time),
    ("v", Column::VoltageOfAll),
    ("u", Column::VoltageOfAll),
    ("volt", Column::VoltageOfAll),
    ("volts", Column::VoltageOfAll),
    ("voltage", Column::VoltageOfAll),
    ("spannung", Column::VoltageOfAll),
    ("drive", Column::VoltageOfAll),
    ("bias", Column::VoltageOfAll),
    ("v1", Column::Voltage(0)),
    ("v2", Column::Voltage(1)),
    ("v3", Column::Voltage(2)),
    ("v4", Column::Voltage(3)),
    ("i", Column::CurrentOfEach),
    ("amps", Column::CurrentOfEach),
    ("current", Column::CurrentOfEach),
    ("strom", Column::CurrentOfEach),
    ("i1", Column::Current(0)),
    ("i2", Column::Current(1)),
    ("i3", Column::Current(2)),
    ("i4", Column::Current(3)),
    ("z", Column::Displacement),
    ("d", Column::Displacement),
    ("height", Column::Displacement),
    ("displacement", Column::Displacement),
    ("deflection", Column::Displacement),
    ("position", Column::Displacement),
    ("weg", Column::Displacement),
    ("hub", Column::Displacement),
    ("t_ambient", Column::Ambient),
    ("ambient", Column::Ambient),
    ("temperature", Column::Ambient),
    ("temp", Column::Ambient),
    ("temperatur", Column::Ambient),
    ("tilt_x", Column::TiltX),
    ("tilt_y", Column::TiltY),
    ("reference", Column::Reference),
];

/// Units with what their numbers are multiplied with to be in the measurement file's, after something is added.
const UNITS: [(&str, &str, f64, f64); 25] = [
    ("s", "s", 1.0, 0.0),
    ("sec", "s", 1.0, 0.0),
    ("ms", "s", 1e-3, 0.0),
    ("us", "s", 1e-6, 0.0),
    ("min", "s", 60.0, 0.0),
    ("h", "s", 3600.0, 0.0),
    ("v", "V", 1.0, 0.0),
    ("mv", "V", 1e-3, 0.0),
    ("kv", "V", 1e3, 0.0),
    ("a", "A", 1.0, 0.0),
    ("ma", "A", 1e-3, 0.0),
    ("ua", "A", 1e-6, 0.0),
    ("na", "A", 1e-9, 0.0),
    ("m", "um", 1e6, 0.0),
    ("cm", "um", 1e4, 0.0),
    ("mm", "um", 1e3, 0.0),
    ("um", "um", 1.0, 0.0),
    ("nm", "um", 1e-3, 0.0),
    ("pm", "um", 1e-6, 0.0),
    ("deg", "deg", 1.0, 0.0),
    ("rad", "deg", 180.0 / std::f64::consts::PI, 0.0),
    ("mrad", "deg", 0.18 / std::f64::consts::PI, 0.0),
    ("c", "C", 1.0, 0.0),
    ("degc", "C", 1.0, 0.0),
    ("k", "C", 1.0, -273.15),
];

/// The quantities that the names of a table's columns say, with their units: `Voltage (mV)`, `I [mA]`, `t/s`, `height_nm`.
pub fn guesses(table: &Table) -> Vec<Assignment> {
    let guess = |(source, name): (usize, &String)| {
        let (quantity, unit) = parts(name);
        let column = known(&quantity)?;
        let (factor, added) = match unit {
            Some(unit) => conversion(column, &unit)?,
            None => (1.0, 0.0),
        };
        Some(Assignment {
            source,
            column,
            factor,
            added,
        })
    };
    table.names.iter().enumerate().filter_map(guess).collect()
}

impl Assignment {
    /// What a user says: `QUANTITY=NAME`, `QUANTITY=NAME:UNIT` or `QUANTITY=NAME:UNIT:FACTOR`, as `z=height:nm:-1`. The name
    /// may be the column's number, counted from 1.
    ///
    /// # Errors
    /// Where one of the parts is not known.
    pub fn parse(text: &str, table: &Table) -> Result<Self, ImportError> {
        let form = "write it like z=height:nm:-1: quantity, column, unit, factor";
        let (quantity, rest) = text
            .split_once('=')
            .ok_or_else(|| ImportError::new(format!("'{text}' assigns nothing"), form))?;
        let column = known(&quantity.trim().to_lowercase()).ok_or_else(|| {
            ImportError::new(
                format!("there is no quantity '{quantity}'"),
                "quantities are t, V or V1 to V4, I or I1 to I4, z, T_ambient, tilt_x, tilt_y, reference",
            )
        })?;
        let mut parts = rest.split(':').map(str::trim);
        let name = parts.next().unwrap_or_default();
        let source = place(name, table).ok_or_else(|| {
            ImportError::new(
                format!("the table has no column '{name}'"),
                format!("its columns are {}", table.names.join(", ")),
            )
        })?;
        let unit = parts.next().map(plain).filter(|unit| !unit.is_empty());
        let unit = unit.or_else(|| self::parts(&table.names[source]).1);
        let (scale, added) = match unit {
            Some(unit) => conversion(column, &unit).ok_or_else(|| {
                ImportError::new(
                    format!("'{unit}' is no unit of {quantity}"),
                    "units are s ms us min h, V mV kV, A mA uA nA, m cm mm um nm pm, deg rad mrad, C K",
                )
            })?,
            None => (1.0, 0.0),
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
            factor: scale * times,
            added,
        })
    }

    /// A number of the table in the unit of the measurement file.
    pub(super) fn value(&self, number: f64) -> f64 {
        self.factor * (number + self.added)
    }

    /// The name of the quantity in measurement files.
    pub fn quantity(&self) -> &'static str {
        let mut columns = COLUMNS.iter();
        columns
            .find(|(_, column)| *column == self.column)
            .map_or("", |(name, _)| name)
    }

    /// What is done to the numbers, in words; empty where nothing is.
    pub fn conversion(&self) -> String {
        let added = match self.added {
            0.0 => String::new(),
            added => format!("{added:+}, "),
        };
        if self.factor == 1.0 && added.is_empty() {
            return String::new();
        }
        format!("{added}times {}", self.factor)
    }
}

fn place(name: &str, table: &Table) -> Option<usize> {
    let named = table.names.iter().position(|known| known == name);
    let alone = || {
        let is_it = |known: &String| parts(known).0 == name.to_lowercase();
        table.names.iter().position(is_it)
    };
    let numbered = || {
        let number: usize = name.parse().ok()?;
        (1..=table.names.len())
            .contains(&number)
            .then(|| number - 1)
    };
    named.or_else(alone).or_else(numbered)
}

fn known(quantity: &str) -> Option<Column> {
    let named = NAMES.iter().find(|(name, _)| *name == quantity);
    named.map(|&(_, column)| column)
}

/// A unit in letters that everybody can write.
fn plain(unit: &str) -> String {
    unit.trim()
        .replace(['µ', 'μ'], "u")
        .replace("°", "deg")
        .to_lowercase()
}

/// Quantity and unit of a column's name.
fn parts(name: &str) -> (String, Option<String>) {
    let name = name.trim();
    let quantity = |text: &str| text.trim().to_lowercase().replace(' ', "_");
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((before, after)) = name.split_once(open) {
            let unit = after.trim_end().trim_end_matches(close);
            return (quantity(before), Some(plain(unit)));
        }
    }
    if let Some((before, unit)) = name.split_once('/') {
        return (quantity(before), Some(plain(unit)));
    }
    match name.rsplit_once(['_', ' ']) {
        Some((before, unit)) if is_unit(&plain(unit)) && known(&quantity(before)).is_some() => {
            (quantity(before), Some(plain(unit)))
        }
        _ => (quantity(name), None),
    }
}

fn is_unit(unit: &str) -> bool {
    UNITS.iter().any(|(known, ..)| *known == unit)
}

/// Factor and addend from a unit to the column's own.
fn conversion(column: Column, unit: &str) -> Option<(f64, f64)> {
    let of_column = match column {
        Column::Time | Column::GlobalTime => "s",
        Column::VoltageOfAll | Column::Voltage(_) => "V",
        Column::CurrentOfEach | Column::Current(_) => "A",
        Column::Displacement | Column::Reference | Column::Asked | Column::Uncertainty => "um",
        Column::TiltX | Column::TiltY | Column::AskedTiltX | Column::AskedTiltY => "deg",
        Column::Ambient => "C",
        Column::Trigger => return None,
    };
    let mut units = UNITS.iter();
    let found = units.find(|(known, to, ..)| *known == unit && *to == of_column);
    found.map(|&(_, _, factor, added)| (factor, added))
}
