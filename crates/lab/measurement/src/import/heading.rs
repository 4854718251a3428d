//! What stands above a column: its quantity and its unit.

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

    /// Whether it is nothing but a unit.
    pub(super) fn is_bare_unit(&self) -> bool {
        self.unit == Some(self.quantity)
    }
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
    if let Some((before, unit)) = heading.split_once('/') {
        return Some((before.trim(), Some(unit)));
    }
    let (before, unit) = heading.rsplit_once(['_', ' '])?;
    let is_both = Unit::read(unit).is_some() && quantity::named(before).is_some();
    is_both.then(|| (before.trim(), Some(unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_have_a_quantity_and_a_unit() {
        for (heading, quantity, unit) in [
            ("Voltage (mV)", "Voltage", Some("mV")),
            ("Spannung 1 [V]", "Spannung 1", Some("V")),
            ("Voltage (set) [V]", "Voltage (set)", Some("V")),
            ("t/s", "t", Some("s")),
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
