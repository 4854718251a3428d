//! A cell of a table as a number: decimal commas, thousands separators, dates and clock times.

use super::moment;
use chrono::{Datelike, NaiveDate};

/// Separators of thousands: commas or points, as the decimal sign is the other; apostrophes; blanks, those that do not break a line too.
const THOUSANDS: [char; 6] = [',', '.', '\'', ' ', '\u{a0}', '\u{202f}'];

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Numbers {
    pub(super) decimal_comma: bool,
    /// Digits before the decimal sign stand in groups of three.
    pub(super) grouped: bool,
    /// The day stands before the month between slashes.
    pub(super) day_first: bool,
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    Number(f64),
    /// A date and a time (s).
    Instant(f64),
    /// A time of some day (s).
    Clock(f64),
    /// How long something took, or a time of some day as LibreOffice stores it (s).
    Duration(f64),
    /// Parts of a hundred.
    Percent(f64),
}

impl Numbers {
    /// The cell's content, where it is any of these.
    pub(super) fn cell(self, text: &str) -> Option<Cell> {
        // Unicode's minus sign.
        if let Some(digits) = text.strip_prefix('\u{2212}') {
            return self.cell(&format!("-{}", digits.trim_start_matches('-')));
        }
        self.number(text)
            .map(Cell::Number)
            .or_else(|| self.instant(text))
            .or_else(|| moment::seconds(text).map(Cell::Instant))
            .or_else(|| minutes_s(text).map(Cell::Duration))
            .or_else(|| duration_s(text).map(Cell::Duration))
            .or_else(|| {
                let number = text.strip_suffix('%')?.trim_end();
                self.number(number).map(Cell::Percent)
            })
    }

    /// A number, whose exponent Fortran writes with a D where it is of double precision (ISO/IEC 1539-1:2023, 13.7.2.3.3).
    fn number(self, text: &str) -> Option<f64> {
        let with_e = || {
            let (digits, exponent) = text.split_once(['D', 'd'])?;
            let is_number = digits.ends_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',');
            let is_exponent = exponent.ends_with(|c: char| c.is_ascii_digit());
            (is_number && is_exponent).then(|| format!("{digits}e{exponent}"))
        };
        self.with_an_e(text).or_else(|| self.with_an_e(&with_e()?))
    }

    /// An infinity is a number.
    fn with_an_e(self, text: &str) -> Option<f64> {
        let number: f64 = match self {
            Self {
                decimal_comma: false,
                grouped: false,
                ..
            } => text.parse().ok()?,
            Self {
                decimal_comma: true,
                grouped: false,
                ..
            } if !text.contains('.') => text.replace(',', ".").parse().ok()?,
            Self { grouped: false, .. } => return None,
            _ => self.ungrouped(text)?.parse().ok()?,
        };
        (!number.is_nan()).then_some(number)
    }

    /// The decimal sign.
    pub(super) fn sign(self) -> char {
        if self.decimal_comma { ',' } else { '.' }
    }

    /// What the decimal sign is called.
    pub(super) fn decimals(self) -> &'static str {
        if self.decimal_comma {
            "commas"
        } else {
            "points"
        }
    }

    /// Numbers with the other decimal sign, and without groups.
    pub(super) fn with_the_other_sign(self) -> Self {
        Self {
            decimal_comma: !self.decimal_comma,
            grouped: false,
            ..self
        }
    }

    /// Numbers beside dates in which the day stands first between slashes.
    pub(super) fn with_the_day_first(self) -> Self {
        Self {
            day_first: true,
            ..self
        }
    }

    /// `1,234.5` as `1234.5`; `None` where groups are not of three digits, or begin with a 0: that is before a decimal sign.
    fn ungrouped(self, text: &str) -> Option<String> {
        let decimal = self.sign();
        let (whole, rest) = match text.split_once(decimal) {
            Some((whole, rest)) => (whole, Some(rest)),
            None => (text, None),
        };
        let is_separator = |c: char| c != decimal && THOUSANDS.contains(&c);
        let mut groups = whole.split(is_separator);
        let first = groups.next()?;
        let mut digits = first.to_owned();
        let leading = first.trim_start_matches(['+', '-']);
        for group in groups {
            if !(1..=3).contains(&leading.len())
                || leading.starts_with('0')
                || group.len() != 3
                || !group.bytes().all(|b| b.is_ascii_digit())
            {
                return None;
            }
            digits += group;
        }
        Some(match rest {
            Some(rest) => format!("{digits}.{rest}"),
            None => digits,
        })
    }

    /// `2026-11-24T13:05:00.25`, `24.11.2026 13:05:00`, `11/24/2026 1:05:00 PM`, `13:05:00,25` and the like.
    fn instant(self, text: &str) -> Option<Cell> {
        let text = text.trim_end_matches('Z');
        if !text.contains(':') || text.len() > 40 {
            return None;
        }
        let (date, clock) = match text.split_once(['T', ' ']) {
            Some((date, clock)) if date.contains(['-', '/', '.']) => (Some(date), clock.trim()),
            _ => (None, text),
        };
        let seconds = clock_s(clock)?;
        match date {
            Some(date) => Some(Cell::Instant(self.day(date)? * 86_400.0 + seconds)),
            None => Some(Cell::Clock(seconds)),
        }
    }

    /// Days from a first one on: `2026-11-24`, `24.11.2026`, `11/24/2026`. What can be no month between slashes is the day. `None` where
    /// the calendar has no such day.
    fn day(self, text: &str) -> Option<f64> {
        let separator = text.chars().find(|c| !c.is_ascii_digit())?;
        let parts: Vec<u32> = text
            .split(separator)
            .map(str::parse)
            .collect::<Result<_, _>>()
            .ok()?;
        let parts: [u32; 3] = parts.try_into().ok()?;
        let [year, month, day] = match parts {
            [year, month, day] if year > 31 => [year, month, day],
            [one, other, year] => {
                let is_day_first = separator != '/' || one > 12 || self.day_first && other <= 12;
                match is_day_first {
                    true => [year, other, one],
                    false => [year, one, other],
                }
            }
        };
        let date = NaiveDate::from_ymd_opt(year.try_into().ok()?, month, day)?;
        Some(f64::from(date.num_days_from_ce()))
    }
}

/// Whether a number's one comma or point may be a decimal sign or separate thousands: `3.789`, and neither `0.789` nor `3.78`.
pub(super) fn is_in_doubt(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-']);
    let Some((whole, rest)) = digits.split_once([',', '.']) else {
        return false;
    };
    let are_digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
    let is_group = rest.len() == 3 && are_digits(rest);
    is_group && (1..=3).contains(&whole.len()) && are_digits(whole) && !whole.starts_with('0')
}

/// A time of a day, its hours from 0 to 23 or with AM and PM (s).
fn clock_s(text: &str) -> Option<f64> {
    let upper = text.to_ascii_uppercase();
    let (time, half) = match (upper.strip_suffix("AM"), upper.strip_suffix("PM")) {
        (Some(time), _) => (time.trim(), Some(0)),
        (_, Some(time)) => (time.trim(), Some(12)),
        _ => (upper.as_str(), None),
    };
    let mut parts = time.split(':');
    let hours: u32 = parts.next()?.parse().ok()?;
    let minutes: u32 = parts.next()?.parse().ok()?;
    let seconds: f64 = parts.next().unwrap_or("0").replace(',', ".").parse().ok()?;
    // Some loggers write milliseconds behind a colon, too.
    let milliseconds = match parts.next() {
        Some(digits) if digits.len() == 3 => f64::from(digits.parse::<u16>().ok()?),
        Some(_) => return None,
        None => 0.0,
    };
    let seconds = seconds + 1e-3 * milliseconds;
    let hours = half.map_or(hours, |half| hours % 12 + half);
    let is_time = hours < 24 && minutes < 60 && (0.0..61.0).contains(&seconds);
    (is_time && parts.next().is_none()).then(|| f64::from(3600 * hours + 60 * minutes) + seconds)
}

/// Minutes, and seconds with decimals behind a colon, as spreadsheets show them: `00:50.0` (s).
fn minutes_s(text: &str) -> Option<f64> {
    let (minutes, seconds) = text.split_once(':')?;
    let minutes: u32 = minutes.parse().ok()?;
    let has_decimals = seconds.contains(['.', ',']);
    let seconds: f64 = seconds.replace(',', ".").parse().ok()?;
    let is_one = has_decimals && (0.0..60.0).contains(&seconds);
    is_one.then(|| 60.0 * f64::from(minutes) + seconds)
}

/// A duration of ISO 8601 in hours, minutes and seconds, as spreadsheets write it: `PT1H02M03.5S` (s).
fn duration_s(text: &str) -> Option<f64> {
    let mut rest = text.strip_prefix("PT").filter(|rest| !rest.is_empty())?;
    let mut seconds = 0.0;
    for (letter, factor) in [('H', 3600.0), ('M', 60.0), ('S', 1.0)] {
        if let Some((number, after)) = rest.split_once(letter) {
            let number: f64 = number.replace(',', ".").parse().ok()?;
            seconds += factor * number;
            rest = after;
        }
    }
    (rest.is_empty() && f64::is_finite(seconds)).then_some(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Numbers = Numbers {
        decimal_comma: false,
        grouped: false,
        day_first: false,
    };

    #[test]
    fn thousands_are_told_from_decimals() {
        let grouped = Numbers {
            grouped: true,
            ..PLAIN
        };
        for (text, number) in [
            ("1,234.5", Some(1234.5)),
            ("-12,345,678", Some(-12_345_678.0)),
            ("1'234", Some(1234.0)),
            ("18 112", Some(18_112.0)),
            ("1 2", None),
            ("1,23", None),
            ("1234,567", None),
            ("0,567", None),
        ] {
            assert_eq!(grouped.cell(text), number.map(Cell::Number), "{text}");
        }
        let german = Numbers {
            decimal_comma: true,
            grouped: true,
            ..PLAIN
        };
        assert_eq!(german.cell("1.234,5"), Some(Cell::Number(1234.5)));
    }

    #[test]
    fn an_exponent_may_be_a_d() {
        let german = Numbers {
            decimal_comma: true,
            ..PLAIN
        };
        assert_eq!(german.cell("9,5D-07"), Some(Cell::Number(9.5e-7)));
        assert_eq!(PLAIN.cell("1.d+02"), Some(Cell::Number(100.0)));
        for text in ["3D", "D-07", "1D-", "add1"] {
            assert_eq!(PLAIN.cell(text), None, "{text}");
        }
    }

    #[test]
    fn dates_and_clocks_are_seconds() {
        let Some(Cell::Instant(noon)) = PLAIN.cell("2026-11-24T12:00:00") else {
            panic!("an instant")
        };
        for (text, after_s) in [
            ("2026-11-24 12:00:01.5", 1.5),
            ("24.11.2026 12:00:00", 0.0),
            ("11/24/2026 12:00:00 PM", 0.0),
            ("11/25/2026 1:00:00 AM", 13.0 * 3600.0),
            ("2027-03-01T12:00:00Z", 97.0 * 86_400.0),
            ("2024-02-29T12:00:00", -999.0 * 86_400.0),
        ] {
            assert_eq!(
                PLAIN.cell(text),
                Some(Cell::Instant(noon + after_s)),
                "{text}"
            );
        }
        assert_eq!(PLAIN.cell("31.02.2026 12:00:00"), None);
        assert_eq!(
            PLAIN.cell("13:05:00,25"),
            Some(Cell::Clock(13.0 * 3600.0 + 300.25))
        );
        assert_eq!(PLAIN.cell("PT1H1M2.5S"), Some(Cell::Duration(3662.5)));
        assert_eq!(PLAIN.cell("7.5 %"), Some(Cell::Percent(7.5)));
        assert_eq!(PLAIN.cell("00:00:01:500"), Some(Cell::Clock(1.5)));
        assert_eq!(PLAIN.cell("01:50.5"), Some(Cell::Duration(110.5)));
        assert_eq!(PLAIN.cell("\u{2212}5"), Some(Cell::Number(-5.0)));
        for text in [
            "PT",
            "PT1",
            "PTnanS",
            "%",
            "25:00",
            "12:61",
            "a:b",
            "1:2:3:4",
            "2026-13-01T00:00:00",
            ":",
        ] {
            assert_eq!(PLAIN.cell(text), None, "{text}");
        }
    }
}
