//! Differences of rows that cancel what is smooth, over even times or along a drive, and leave the readings' noise.

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

/// The weights of the highest divided difference along a drive that only rises or only falls.
pub(super) fn along_drive(volts: &[f64]) -> Option<Vec<f64>> {
    let is_one_way = volts.is_sorted_by(|a, b| a < b) || volts.is_sorted_by(|a, b| a > b);
    is_one_way.then(|| divided_difference(volts))
}

/// The weights of the highest divided difference at these places.
fn divided_difference(places: &[f64]) -> Vec<f64> {
    let scale = places[places.len() - 1] - places[0];
    let weight = |(index, at): (usize, &f64)| {
        let others = places
            .iter()
            .enumerate()
            .filter(|&(other, _)| other != index);
        1.0 / others
            .map(|(_, other)| (at - other) / scale)
            .product::<f64>()
    };
    places.iter().enumerate().map(weight).collect()
}
