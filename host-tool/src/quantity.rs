//! Quantities as people write them: `120um`, `120 µm`, `0.12mm`, `1.9V`, `500ms`.

mod pose;

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

pub use pose::TiltedPose;

/// The sign that typesetters use, and that people paste.
pub const MINUS: char = '\u{2212}';

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

/// How long a command holds once the mirror has settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// For so long.
    For(Span),
    /// Until something else is asked.
    Forever,
}

/// Why a text is not the quantity that was expected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QuantityError {
    /// There is no number at its start.
    #[error("`{text}` does not start with a number; write for example {example}")]
    NoNumber {
        /// What was written.
        text: String,
        /// What would be right.
        example: &'static str,
    },
    /// There is nothing behind the number.
    #[error("`{text}` has no unit; write for example {text}{unit}")]
    NoUnit {
        /// What was written.
        text: String,
        /// The usual unit.
        unit: &'static str,
    },
    /// Its decimal sign is a comma.
    #[error("`{text}` has a decimal comma; write {point}")]
    Comma {
        /// What was written.
        text: String,
        /// The same with a point.
        point: String,
    },
    /// The unit belongs to something else, or to nothing.
    #[error("`{unit}` is not a unit of {what}; use one of {known}")]
    WrongUnit {
        /// The unit that was written.
        unit: String,
        /// What is measured.
        what: &'static str,
        /// The units that are.
        known: String,
    },
    /// The number cannot be used.
    #[error("`{text}` is not {what} that can be used; write for example {example}")]
    Unusable {
        /// What was written.
        text: String,
        /// What is measured.
        what: &'static str,
        /// What would be right.
        example: &'static str,
    },
}

/// A kind of quantity: its units, each with what to multiply and to divide by to come to the first.
/// Both are whole but for radians, so that `10us` is exactly `1e-5 s`.
struct Notation {
    what: &'static str,
    example: &'static str,
    units: &'static [(&'static str, f64, f64)],
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
        ("rad", 180.0, std::f64::consts::PI),
    ],
};
const VOLTAGE: Notation = Notation {
    what: "a voltage",
    example: "1.9V",
    units: &[("V", 1.0, 1.0), ("v", 1.0, 1.0), ("mV", 1.0, 1e3)],
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

impl Notation {
    fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        let text = &text.trim().replace(MINUS, "-");
        let (number, unit) = split(text);
        let Ok(number) = number.parse::<f64>() else {
            return Err(QuantityError::NoNumber {
                text: text.to_owned(),
                example: self.example,
            });
        };
        if unit.is_empty() {
            return Err(QuantityError::NoUnit {
                text: text.to_owned(),
                unit: self.units[0].0,
            });
        }
        if unit
            .strip_prefix(',')
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        {
            return Err(QuantityError::Comma {
                text: text.to_owned(),
                point: text.replacen(',', ".", 1),
            });
        }
        let Some((_, times, over)) = self.units.iter().find(|(known, ..)| *known == unit) else {
            return Err(self.wrong_unit(unit));
        };
        let value = number * times / over;
        if value.is_finite() {
            // A zero has no sign.
            Ok(value + 0.0)
        } else {
            Err(self.unusable(text))
        }
    }

    fn wrong_unit(&self, unit: &str) -> QuantityError {
        let known: Vec<&str> = self.units.iter().map(|(known, ..)| *known).collect();
        QuantityError::WrongUnit {
            unit: unit.to_owned(),
            what: self.what,
            known: known.join(", "),
        }
    }

    fn unusable(&self, text: &str) -> QuantityError {
        QuantityError::Unusable {
            text: text.to_owned(),
            what: self.what,
            example: self.example,
        }
    }
}

/// Number and unit: the number is as long as it can be, an exponent only where digits follow.
fn split(text: &str) -> (&str, &str) {
    let end = (1..=text.len())
        .rev()
        .filter(|end| text.is_char_boundary(*end))
        .find(|end| is_number(&text[..*end]))
        .unwrap_or(0);
    (&text[..end], text[end..].trim_start())
}

/// Digits and signs only: Rust also takes `inf` and `nan` for numbers.
fn is_number(text: &str) -> bool {
    let allowed = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    text.chars().all(allowed) && text.parse::<f64>().is_ok()
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
