//! The lines above a table that have the names of its columns.

use super::error::ImportError;
use super::heading::{Heading, contradiction, headings};
use super::quantity;
use super::unit::Unit;
use std::borrow::Cow;

/// Names in the lines above a table, the nearest first, of which those that are not as wide as it are `None`: remarks may stand
/// between. They are in the nearest line that names two columns; where none does, in the one right above the table.
///
/// # Errors
/// Where a line of units contradicts the units of the names above it.
pub(super) fn names(
    above: &[Option<Vec<Cow<'_, str>>>],
) -> Result<Option<Vec<String>>, ImportError> {
    let whole: Vec<&Vec<Cow<'_, str>>> = above.iter().flatten().collect();
    let right_above = || above.first()?.as_ref().map(|_| 0);
    let at = whole.iter().position(|cells| is_one(cells));
    let Some(at) = at.or_else(right_above) else {
        return Ok(None);
    };
    let above = whole.get(at + 1).map(|cells| &cells[..]);
    match contradiction(whole[at], above) {
        Some(error) => Err(error),
        None => Ok(Some(headings(whole[at], above))),
    }
}

/// Whether two cells, or more, name a quantity, a unit or an oscilloscope's channel.
pub(super) fn is_one(cells: &[Cow<'_, str>]) -> bool {
    let is_name = |cell: &&Cow<'_, str>| {
        let Heading { quantity, unit } = Heading::read(cell);
        unit.is_some_and(|unit| Unit::read(unit).is_some())
            || quantity::named(quantity).is_some()
            || is_channel(quantity)
    };
    cells.iter().filter(is_name).count() >= 2
}

/// Whether a name is `CH2` or the like.
fn is_channel(name: &str) -> bool {
    let number = name.strip_prefix("CH").unwrap_or_default();
    !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
}
