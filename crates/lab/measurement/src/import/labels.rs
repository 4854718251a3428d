//! Labels by which instruments tell what samples are: beside the first of them, as Tektronix's older oscilloscopes write
//! `Vertical Units,V,,-0.0012,0.02`, or above them.

use super::heading::Heading;
use super::quantity;
use super::unit::Unit;
use crate::column::Column;
use std::borrow::Cow;

/// What the columns are called whose samples begin beside labels; the others by their numbers. `None` where no label tells it.
pub(super) fn names(
    lines: &[Vec<Cow<'_, str>>],
    is_number: impl Fn(&str) -> bool,
) -> Option<Vec<String>> {
    let said = |label: &str| {
        let line = lines.iter().find(|cells| cells[0] == label)?;
        line.get(1).filter(|value| !value.is_empty())
    };
    said("Record Length").and(said("Sample Interval"))?;
    let cells = lines.last()?;
    let samples: Vec<usize> = (0..cells.len())
        .filter(|&at| is_number(&cells[at]))
        .collect();
    let [time, reading] = samples[..] else {
        return None;
    };
    // A spectrum is over frequency.
    let unit = said("Horizontal Units").map_or("s", |unit| unit.as_ref());
    Unit::read(unit).filter(|unit| unit.is_of(Column::Time))?;
    let mut names: Vec<String> = (1..=cells.len()).map(|number| number.to_string()).collect();
    names[time] = format!("Time ({unit})");
    if let Some(source) = said("Source") {
        let unit = said("Vertical Units").map(|unit| format!(" ({unit})"));
        names[reading] = format!("{source}{}", unit.unwrap_or_default());
    }
    Some(names)
}

/// Names with the units that one of the lines above them states in their columns, behind a label that speaks of units,
/// `Y_Unit_Label`; as they are where none does, or a quantity would have another's unit.
pub(super) fn with_units<'l>(
    names: Vec<String>,
    mut above: impl Iterator<Item = Vec<Cow<'l, str>>>,
) -> Vec<String> {
    let is_unit = |cell: &&Cow<'_, str>| Unit::read(cell).is_some();
    let states_units = |cells: &Vec<Cow<'_, str>>| {
        let mut words = cells[0].split(|c: char| !c.is_alphabetic());
        let is_it = words.any(|word| ["unit", "units"].contains(&&*word.to_lowercase()));
        is_it && cells.iter().filter(is_unit).count() >= 2
    };
    let units = above.find(states_units).unwrap_or_default();
    let of = |column: usize| units.get(column).and_then(|unit| Unit::read(unit));
    let is_another = |(column, name): (usize, &String)| {
        let quantity = quantity::named(Heading::read(name).quantity);
        let both = quantity.zip(of(column));
        both.is_some_and(|(quantity, unit)| !unit.is_of(quantity))
    };
    if names.iter().enumerate().any(is_another) {
        return names;
    }
    let named = names
        .into_iter()
        .enumerate()
        .map(|(column, name)| match of(column) {
            Some(_) if Heading::read(&name).unit.is_none() => format!("{name} ({})", units[column]),
            _ => name,
        });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_behind_a_label_are_those_of_the_columns() {
        let units = |label: &str| vec![label.to_owned().into(), "V".into(), "mA".into()];
        let with = |names: [&str; 3], label: &str| {
            let names = names.map(str::to_owned).to_vec();
            with_units(names, [units(label)].into_iter())
        };
        let named = ["TIME", "CH1 (V)", "CH2 (mA)"];
        assert_eq!(with(["TIME", "CH1", "CH2"], "Vertical Units"), named);
        assert_eq!(with(["t", "z", "I"], "Y_Unit_Label"), ["t", "z", "I"]);
        assert_eq!(with(["t", "U", "I"], "Unity"), ["t", "U", "I"]);
    }
}
