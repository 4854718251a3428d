//! Units of a table's numbers, and how they become those of measurement files.

use crate::column::Column;

/// A unit that is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    /// As it is written.
    pub(super) name: &'static str,
    /// The measurement file's unit of that dimension.
    of: &'static str,
    /// What its numbers are multiplied with, after something is added.
    pub(super) factor: f64,
    pub(super) added: f64,
}

/// What a user may choose from.
pub(super) const CHOICE: &str =
    "units are s ms us min h, V mV kV, A mA uA nA, m cm mm um nm pm, deg rad mrad, C K degF";

const UNITS: [Unit; 53] = [
    unit("s", "s", 1.0),
    unit("sec", "s", 1.0),
    unit("sek", "s", 1.0),
    unit("second", "s", 1.0),
    unit("seconds", "s", 1.0),
    unit("ms", "s", 1e-3),
    unit("msec", "s", 1e-3),
    unit("millisecond", "s", 1e-3),
    unit("milliseconds", "s", 1e-3),
    unit("us", "s", 1e-6),
    unit("usec", "s", 1e-6),
    unit("microsecond", "s", 1e-6),
    unit("microseconds", "s", 1e-6),
    unit("ns", "s", 1e-9),
    unit("min", "s", 60.0),
    unit("h", "s", 3600.0),
    unit("V", "V", 1.0),
    unit("volt", "V", 1.0),
    unit("volts", "V", 1.0),
    unit("VDC", "V", 1.0),
    unit("mV", "V", 1e-3),
    unit("kV", "V", 1e3),
    unit("A", "A", 1.0),
    unit("ampere", "A", 1.0),
    unit("amps", "A", 1.0),
    unit("ADC", "A", 1.0),
    unit("mA", "A", 1e-3),
    unit("mAmps", "A", 1e-3),
    unit("uA", "A", 1e-6),
    unit("nA", "A", 1e-9),
    unit("m", "um", 1e6),
    unit("cm", "um", 1e4),
    unit("mm", "um", 1e3),
    unit("um", "um", 1.0),
    unit("micron", "um", 1.0),
    unit("microns", "um", 1.0),
    unit("micrometer", "um", 1.0),
    unit("micrometers", "um", 1.0),
    unit("micrometre", "um", 1.0),
    unit("micrometres", "um", 1.0),
    unit("mikrometer", "um", 1.0),
    unit("nanometer", "um", 1e-3),
    unit("\u{e5}", "um", 1e-4),
    unit("nm", "um", 1e-3),
    unit("pm", "um", 1e-6),
    unit("deg", "deg", 1.0),
    unit("grad", "deg", 1.0),
    unit("rad", "deg", 180.0 / std::f64::consts::PI),
    unit("mrad", "deg", 0.18 / std::f64::consts::PI),
    unit("C", "C", 1.0),
    unit("degC", "C", 1.0),
    Unit {
        added: -32.0,
        ..unit("degF", "C", 5.0 / 9.0)
    },
    Unit {
        added: -273.15,
        ..unit("K", "C", 1.0)
    },
];

const fn unit(name: &'static str, of: &'static str, factor: f64) -> Unit {
    Unit {
        name,
        of,
        factor,
        added: 0.0,
    }
}

impl Unit {
    /// The unit that a text is, whatever its case, in brackets or not, with either of Unicode's signs for micro.
    pub(super) fn read(text: &str) -> Option<Self> {
        let text = plain(text);
        let inside = [('(', ')'), ('[', ']')]
            .iter()
            .find_map(|&(open, close)| text.strip_prefix(open)?.strip_suffix(close));
        let name = inside.unwrap_or(&text).trim();
        let mut units = UNITS.into_iter();
        let name = name.to_lowercase();
        units.find(|unit| unit.name.to_lowercase() == name)
    }

    /// What its numbers are multiplied with to be in another unit; `None` where that is of something else, or counts from elsewhere.
    pub(super) fn per(self, other: Self) -> Option<f64> {
        let is_alike = self.of == other.of && self.added == other.added;
        is_alike.then_some(self.factor / other.factor)
    }

    /// Whether a column's numbers may have it.
    pub(super) fn is_of(self, column: Column) -> bool {
        let of_column = match column {
            Column::Time | Column::GlobalTime => "s",
            Column::VoltageOfAll | Column::Voltage(_) => "V",
            Column::CurrentOfEach | Column::Current(_) => "A",
            Column::Displacement | Column::Reference | Column::Asked | Column::Uncertainty => "um",
            Column::TiltX | Column::TiltY | Column::AskedTiltX | Column::AskedTiltY => "deg",
            Column::Ambient => "C",
            Column::Trigger => return false,
        };
        self.of == of_column
    }
}

/// A unit in letters that everybody can write.
fn plain(unit: &str) -> String {
    unit.trim().replace(['µ', 'μ'], "u").replace('°', "deg")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_however_they_are_written() {
        for (text, name) in [
            ("V", "V"),
            ("[mv]", "mV"),
            ("( \u{b5}m )", "um"),
            ("\u{3bc}s", "us"),
            ("°C", "degC"),
        ] {
            assert_eq!(Unit::read(text).map(|unit| unit.name), Some(name), "{text}");
        }
        for text in ["", "()", "V1", "inch", "V)"] {
            assert_eq!(Unit::read(text), None, "{text}");
        }
    }
}
