//! Rows that are held out of the fit of a strength, to tell what an effect is worth where it was not fitted.

use identification::dataset::Dataset;
use nalgebra::DVector;

/// Readings are held out by so many in a row, every other handful, so that what is held out lies between what is kept.
const HANDFUL: usize = 5;
/// Rows held out get their noise times this, so that they weigh nothing: 1e-12 of what they would.
const WEIGHTLESS: f64 = 1e6;

/// Whether each row is held out.
pub(super) fn held_out_rows(data: &Dataset) -> Vec<bool> {
    let rows = data.observations.iter();
    rows.map(|o| o.interval / HANDFUL % 2 == 1).collect()
}

/// The noise of each row where those held out weigh nothing.
pub(super) fn training_noise(data: &Dataset, white_noise: &DVector<f64>) -> DVector<f64> {
    let mut noise = white_noise.clone();
    for (deviation, is_held_out) in noise.iter_mut().zip(held_out_rows(data)) {
        if is_held_out {
            *deviation *= WEIGHTLESS;
        }
    }
    noise
}
