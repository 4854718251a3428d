//! Dates with times in the forms that standards and programs write without blanks or with words.

use chrono::{DateTime, Datelike, NaiveDateTime, Timelike};

/// ISO 8601 without separators, and a month in words, as LabVIEW, MATLAB and spreadsheets write it.
const FORMS: [&str; 5] = [
    "%Y%m%dT%H%M%S%.f",
    "%d-%b-%Y %H:%M:%S%.f",
    "%d %b %Y %H:%M:%S%.f",
    "%b %d, %Y %H:%M:%S%.f",
    "%d-%b-%Y %I:%M:%S%.f %p",
];
/// The shortest and the longest of them.
const LENGTHS: std::ops::RangeInclusive<usize> = 15..=40;

/// Seconds since the year 1 began; with the offset of a time zone, of Greenwich's.
pub(super) fn seconds(text: &str) -> Option<f64> {
    if !LENGTHS.contains(&text.len()) {
        return None;
    }
    let zoned = DateTime::parse_from_rfc3339(text).ok();
    let zoned = zoned.map(|moment| moment.naive_utc());
    let mut forms = FORMS.iter();
    let moment = zoned.or_else(|| {
        forms.find_map(|form| NaiveDateTime::parse_from_str(text.trim_end_matches('Z'), form).ok())
    })?;
    let nanoseconds = f64::from(moment.nanosecond());
    let of_day = f64::from(moment.num_seconds_from_midnight()) + 1e-9 * nanoseconds;
    Some(f64::from(moment.num_days_from_ce()) * 86_400.0 + of_day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_many_forms() {
        let noon = seconds("20260304T120000").expect("a moment");
        for (text, after_s) in [
            ("2026-03-04T13:00:00.250000+01:00", 0.25),
            ("04-Mar-2026 12:00:01", 1.0),
            ("4 Mar 2026 12:00:00.5", 0.5),
            ("Mar 04, 2026 12:00:00", 0.0),
            ("04-Mar-2026 01:00:00 PM", 3600.0),
        ] {
            assert_eq!(seconds(text), Some(noon + after_s), "{text}");
        }
        for text in [
            "31-Feb-2026 12:00:00",
            "20261304T120000",
            "a moment of rest",
            "",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }
}
