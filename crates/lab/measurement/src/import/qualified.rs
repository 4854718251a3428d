//! A number with what people write around it: `17.2 um`, `17.2 ± 0.1`, `~17`.

use super::unit::Unit;

/// What stands before what a reading is uncertain by.
const PLUS_MINUS: [&str; 3] = ["\u{b1}", "+/-", "+-"];
/// What stands before a number that is about right.
const ABOUT: [char; 2] = ['~', '\u{2248}'];

/// A number in its parts.
#[derive(Debug, PartialEq)]
pub(super) struct Qualified<'c> {
    pub(super) number: &'c str,
    pub(super) unit: Option<Unit>,
    /// Whether it says how uncertain it is.
    pub(super) is_uncertain: bool,
}

impl<'c> Qualified<'c> {
    /// Of a cell that is more than a number.
    pub(super) fn read(cell: &'c str) -> Option<Self> {
        let said = cell.trim_start_matches(ABOUT).trim_start();
        let mut signs = PLUS_MINUS.iter();
        let parts = signs.find_map(|sign| said.split_once(sign));
        let (number, spread) = parts.map_or((said, None), |(number, by)| (number, Some(by)));
        let (number, unit) = with_unit(number)?;
        let of_spread = spread
            .map(|spread| with_unit(spread))
            .map_or(Some(None), |read| read.map(|(_, unit)| unit))?;
        Some(Self {
            number,
            unit: unit.or(of_spread),
            is_uncertain: spread.is_some() || said.len() < cell.len(),
        })
    }
}

/// What ends in a digit, and the unit behind it. One in brackets belongs to a heading.
fn with_unit(text: &str) -> Option<(&str, Option<Unit>)> {
    let text = text.trim();
    let end = text.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (number, unit) = text.split_at(end);
    match unit.trim_start() {
        "" => Some((number, None)),
        unit if unit.starts_with(['(', '[']) => None,
        unit => Some((number, Some(Unit::read(unit)?))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_taken_out_of_what_stands_around_it() {
        for (cell, number, unit, is_uncertain) in [
            ("17.2 um", "17.2", Some("um"), false),
            ("-17,2\u{b5}m", "-17,2", Some("um"), false),
            ("17.2\u{b1}0.1", "17.2", None, true),
            ("17.2 +- 0.1 nm", "17.2", Some("nm"), true),
            ("~0.0", "0.0", None, true),
        ] {
            let unit = unit.and_then(Unit::read);
            let read = Qualified {
                number,
                unit,
                is_uncertain,
            };
            assert_eq!(Qualified::read(cell), Some(read), "{cell}");
        }
        for cell in ["OVER", "1 (V)", "17.2 parsec", "17.2\u{b1}", "", "um"] {
            assert_eq!(Qualified::read(cell), None, "{cell}");
        }
    }
}
