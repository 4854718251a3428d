//! How exact the simulation is that everything rests on.

use identification::dataset::Dataset;
use identification::prediction::standard_deviation;
use mirror_model::{Model, Runaway, simulate};

/// How far halving the simulation's step moves any prediction, at most, in standard deviations of its reading.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub(super) fn step_error(model: &Model, data: &Dataset, resolution: f64) -> Result<f64, Runaway> {
    let coarse = data.read(&simulate(model, &data.intervals, resolution)?);
    let fine = data.read(&simulate(model, &data.intervals, resolution / 2.0)?);
    let moved = coarse
        .iter()
        .zip(&fine)
        .zip(&data.observations)
        .map(|((c, f), o)| (c - f).abs() / standard_deviation(o));
    Ok(moved.fold(0.0, f64::max))
}
