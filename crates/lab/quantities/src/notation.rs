//! How a quantity is written: a number and one of its units.

/// The sign that typesetters use, and that people paste.
pub const MINUS: char = '\u{2212}';

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
pub(crate) struct Notation {
    pub(crate) what: &'static str,
    pub(crate) example: &'static str,
    pub(crate) units: &'static [(&'static str, f64, f64)],
}

impl Notation {
    pub(crate) fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        let text = &text.trim().replace(MINUS, "-");
        if let Some(point) = with_point(text) {
            return Err(QuantityError::Comma {
                text: text.to_owned(),
                point,
            });
        }
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

    pub(crate) fn unusable(&self, text: &str) -> QuantityError {
        QuantityError::Unusable {
            text: text.to_owned(),
            what: self.what,
            example: self.example,
        }
    }
}

/// A number with a decimal comma as it would be written with a point, without points between its thousands.
fn with_point(text: &str) -> Option<String> {
    let (whole, behind) = text.split_once(',')?;
    let mut groups = whole.trim_start_matches(['+', '-']).split('.');
    let is_digits = |group: &str| group.chars().all(|c| c.is_ascii_digit());
    let is_whole = groups
        .next()
        .is_some_and(|first| !first.is_empty() && is_digits(first))
        && groups.all(|group| group.len() == 3 && is_digits(group));
    // Before a point or another comma it stands between thousands.
    let is_decimal = is_whole
        && behind.starts_with(|c: char| c.is_ascii_digit())
        && !behind.contains(['.', ',']);
    is_decimal.then(|| format!("{}.{behind}", whole.replace('.', "")))
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
