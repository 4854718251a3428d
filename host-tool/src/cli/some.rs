//! Quantities of which there must be some, refused in words.

use std::fmt::Display;
use std::str::FromStr;

/// Quantities more than none, as an option takes them that says how long or how far something is measured.
pub(super) fn some<T>(
    amount: fn(&T) -> f64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr<Err: Display> + Clone + Send + Sync + 'static,
{
    move |text| {
        let quantity: T = text.parse().map_err(|error: T::Err| error.to_string())?;
        match amount(&quantity) > 0.0 {
            true => Ok(quantity),
            false => Err(format!("`{text}` is none, and nothing would be measured")),
        }
    }
}
