//! Rows at even times, whose differences are those of one filter.

use measurement::Row;

/// Rows are even whose steps of time differ by less than this share: times are written with three digits and more.
const EVEN: f64 = 0.01;

/// Whether all steps of time are alike.
pub(super) fn is_even(rows: &[Row]) -> bool {
    let steps = || rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    let longest = steps().fold(0.0, f64::max);
    let shortest = steps().fold(f64::INFINITY, f64::min);
    shortest > (1.0 - EVEN) * longest
}
