//! Labels beside the first samples, by which Tektronix's older oscilloscopes tell what these are: `Vertical Units,V,,-0.0012,0.02`.

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
