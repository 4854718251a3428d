//! Quantities as people write them: `120um`, `120 µm`, `0.12mm`, `1.9V`, `500ms`; on a command line, at a prompt, to an instrument.

mod notation;

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use notation::Notation;
pub use notation::{MINUS, QuantityError};

/// A position or displacement.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Length {
    /// In micrometres.
    pub um: f64,
}

/// A rotation of the plate.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Angle {
    /// In degrees.
    pub deg: f64,
}

/// A voltage.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Voltage {
    /// In volts.
    pub v: f64,
}

/// A frequency, above zero.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Frequency {
    /// In hertz.
    pub hz: f64,
}

/// A resistance, above zero.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Resistance {
    /// In ohms.
    pub ohm: f64,
}

/// A time span, zero or longer.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Span {
    /// In seconds.
    pub s: f64,
}

/// A temperature.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Temperature {
    /// In degrees Celsius.
    pub celsius: f64,
}

/// How much warmer something is than something else.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct TemperatureRise {
    /// In kelvins.
    pub k: f64,
}

/// How long a command holds once the mirror has settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// For so long.
    For(Span),
    /// Until something else is asked.
    Forever,
}

const LENGTH: Notation = Notation {
    what: "a position",
    example: "120um",
    units: &[
        ("um", 1.0, 1.0),
        ("µm", 1.0, 1.0),
        ("μm", 1.0, 1.0),
        ("nm", 1.0, 1e3),
        ("mm", 1e3, 1.0),
        ("m", 1e6, 1.0),
    ],
};
const ANGLE: Notation = Notation {
    what: "a tilt",
    example: "0.05deg",
    units: &[
        ("deg", 1.0, 1.0),
        ("°", 1.0, 1.0),
        ("mdeg", 1.0, 1e3),
        ("mrad", 180.0, 1e3 * std::f64::consts::PI),
        ("urad", 180.0, 1e6 * std::f64::consts::PI),
        ("µrad", 180.0, 1e6 * std::f64::consts::PI),
        ("μrad", 180.0, 1e6 * std::f64::consts::PI),
        ("rad", 180.0, std::f64::consts::PI),
    ],
};
const VOLTAGE: Notation = Notation {
    what: "a voltage",
    example: "1.9V",
    units: &[
        ("V", 1.0, 1.0),
        ("v", 1.0, 1.0),
        ("mV", 1.0, 1e3),
        ("uV", 1.0, 1e6),
    ],
};
const RESISTANCE: Notation = Notation {
    what: "a resistance above 0",
    example: "499ohm",
    units: &[
        ("ohm", 1.0, 1.0),
        ("Ohm", 1.0, 1.0),
        ("Ω", 1.0, 1.0),
        ("kohm", 1e3, 1.0),
        ("kΩ", 1e3, 1.0),
    ],
};
const FREQUENCY: Notation = Notation {
    what: "a frequency above 0",
    example: "20Hz",
    units: &[
        ("Hz", 1.0, 1.0),
        ("hz", 1.0, 1.0),
        ("mHz", 1.0, 1e3),
        ("kHz", 1e3, 1.0),
    ],
};
const TEMPERATURE: Notation = Notation {
    what: "a temperature",
    example: "22.5degC",
    units: &[("degC", 1.0, 1.0), ("°C", 1.0, 1.0)],
};
const TEMPERATURE_RISE: Notation = Notation {
    what: "a temperature difference",
    example: "10K",
    units: &[("K", 1.0, 1.0), ("mK", 1.0, 1e3)],
};
/// The board's count of ticks turns over after 119 h.
const MAX_SPAN_S: f64 = 360_000.0;
const SPAN: Notation = Notation {
    what: "a time span up to 100 h",
    example: "500ms",
    units: &[
        ("s", 1.0, 1.0),
        ("ms", 1.0, 1e3),
        ("us", 1.0, 1e6),
        ("µs", 1.0, 1e6),
        ("μs", 1.0, 1e6),
        ("min", 60.0, 1.0),
        ("h", 3600.0, 1.0),
    ],
};

const ALL: [&Notation; 8] = [
    &LENGTH,
    &ANGLE,
    &VOLTAGE,
    &RESISTANCE,
    &FREQUENCY,
    &TEMPERATURE,
    &TEMPERATURE_RISE,
    &SPAN,
];

/// Whether `word` is the unit of the number before it, from which a person set it apart: `120 um`.
pub fn is_unit_of(number: &str, word: &str) -> bool {
    is_unit(word) && number.replace(MINUS, "-").parse::<f64>().is_ok()
}

/// Whether `word` is a unit of any of these quantities.
fn is_unit(word: &str) -> bool {
    let units = ALL.iter().flat_map(|notation| notation.units);
    units.into_iter().any(|(unit, ..)| *unit == word)
}

/// The quantity that `text` is, in `unit` where it names none.
///
/// # Errors
/// Where it is no such quantity.
pub fn in_unit<Q>(text: &str, unit: &str) -> Result<Q, QuantityError>
where
    Q: FromStr<Err = QuantityError>,
{
    match text.parse() {
        Err(QuantityError::NoUnit { text, .. }) => format!("{text} {unit}").parse(),
        parsed => parsed,
    }
}

impl FromStr for Length {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        LENGTH.parse(text).map(|um| Self { um })
    }
}

impl FromStr for Angle {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        ANGLE.parse(text).map(|deg| Self { deg })
    }
}

impl FromStr for Voltage {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        VOLTAGE.parse(text).map(|v| Self { v })
    }
}

impl FromStr for Frequency {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let hz = FREQUENCY.parse(text)?;
        if hz > 0.0 {
            Ok(Self { hz })
        } else {
            Err(FREQUENCY.unusable(text))
        }
    }
}

impl FromStr for Resistance {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let ohm = RESISTANCE.parse(text)?;
        if ohm > 0.0 {
            Ok(Self { ohm })
        } else {
            Err(RESISTANCE.unusable(text))
        }
    }
}

impl FromStr for Span {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let s = SPAN.parse(text)?;
        if !(0.0..=MAX_SPAN_S).contains(&s) {
            Err(SPAN.unusable(text))
        } else {
            Ok(Self { s })
        }
    }
}

impl FromStr for Temperature {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        TEMPERATURE.parse(text).map(|celsius| Self { celsius })
    }
}

impl FromStr for TemperatureRise {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        TEMPERATURE_RISE.parse(text).map(|k| Self { k })
    }
}

impl FromStr for Hold {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        match text.trim() {
            "forever" => Ok(Self::Forever),
            span => span.parse().map(Self::For),
        }
    }
}

impl fmt::Display for Hold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::For(span) => span.fmt(f),
            Self::Forever => f.write_str("forever"),
        }
    }
}

/// As few digits as tell the number, with an exponent where there would be many.
fn write_number(f: &mut fmt::Formatter<'_>, value: f64, unit: &str) -> fmt::Result {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) {
        write!(f, "{value} {unit}")
    } else {
        write!(f, "{value:e} {unit}")
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.um, "um")
    }
}

impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.deg, "deg")
    }
}

impl fmt::Display for Voltage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.v, "V")
    }
}

impl fmt::Display for Resistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.ohm, "ohm")
    }
}

impl fmt::Display for Frequency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.hz, "Hz")
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_number(f, self.s, "s")
    }
}

#[cfg(test)]
mod tests;
