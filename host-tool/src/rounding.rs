//! Numbers in the digits in which they are told.

use quantities::Length;

/// An end of a range as it is told, in whole nanometres towards the middle: what is told may be asked for.
pub(crate) fn nanometres_within(um: f64, towards_middle: fn(f64) -> f64) -> Length {
    /// What a decimal fraction may be off by as a number (nm).
    const ROUNDING_NM: f64 = 1e-6;
    let nm = 1e3 * um;
    let is_whole = (nm - nm.round()).abs() < ROUNDING_NM;
    let nm = if is_whole {
        nm.round()
    } else {
        towards_middle(nm)
    };
    Length { um: nm / 1e3 }
}
