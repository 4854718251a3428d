//! Whole numbers, refused in words.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use quantities::MINUS;

/// Whole numbers from one to another, as an option takes them.
pub(super) fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let typed = text.replace(MINUS, "-");
        let (low, high) = (range.start(), range.end());
        number.ok_or_else(|| format!("`{typed}` is no whole number from {low} to {high}"))
    }
}
