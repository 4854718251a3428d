//! What a model predicts of a dataset, and how that changes with free parameters.

use crate::dataset::{Channel, Dataset, Observation};
use crate::parameter::FreeParameter;
use mirror_model::{Model, Runaway, simulate};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Step control of the simulation, in units of the time since the last jump (see [`simulate`]). Each diagnosis halves it
/// once and reports what that changes (`solver_error`).
pub const RESOLUTION: f64 = 0.5;
/// Standard deviation of the model's discrepancy that every reading is weighed with, beside its noise: of a displacement (um),
/// and of a current, as a part of it. It lies below what lumped equations leave of virtual mirrors with distributed heat
/// (`diagnose` prints that, 0.3 um for a standard session) and keeps fine instruments from deciding alone; `cargo xtask bench
/// diagnose` benches the verdicts with it.
const DISCREPANCY_UM: f64 = 0.1;
const DISCREPANCY_RATIO: f64 = 3e-4;
/// Difference step of a coordinate: between the rounding of the simulation's fixed points (1e-5 K of some 100 K) and the
/// curvature of the slopes.
const DIFFERENCE: f64 = 1e-4;

/// The standard deviation of an observation about the prediction, in its unit: its white noise and the model's discrepancy.
pub fn standard_deviation(observation: &Observation) -> f64 {
    let discrepancy = match observation.channel {
        Channel::Displacement => DISCREPANCY_UM,
        Channel::Current(_) => DISCREPANCY_RATIO * observation.value.abs(),
    };
    observation.noise.hypot(discrepancy)
}

/// Numbers like a dataset's observations, in um and A, in standard deviations.
pub fn standardised(numbers: impl IntoIterator<Item = f64>, data: &Dataset) -> DVector<f64> {
    let rows = numbers
        .into_iter()
        .zip(&data.observations)
        .map(|(number, observation)| number / standard_deviation(observation));
    DVector::from_iterator(data.observations.len(), rows)
}

/// The white noise of a dataset's observations, as a part of their standard deviations.
pub fn white_noise(data: &Dataset) -> DVector<f64> {
    standardised(data.observations.iter().map(|o| o.noise), data)
}

/// A model's predictions of a dataset's observations, in um and A.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn predict(model: &Model, data: &Dataset) -> Result<Vec<f64>, Runaway> {
    Ok(data.read(&simulate(model, &data.intervals, RESOLUTION)?))
}

/// How standardised predictions (rows) change with each parameter's coordinate (columns).
///
/// # Errors
/// [`Runaway`] if the model has no finite answer close by.
pub fn jacobian(
    model: &Model,
    data: &Dataset,
    parameters: &[FreeParameter],
) -> Result<DMatrix<f64>, Runaway> {
    slopes(model, data, parameters, &predict(model, data)?)
}

/// The same where the predictions `here` are known.
pub(crate) fn slopes(
    model: &Model,
    data: &Dataset,
    parameters: &[FreeParameter],
    here: &[f64],
) -> Result<DMatrix<f64>, Runaway> {
    let column = |parameter: &FreeParameter| {
        let (moved, step) = moved(model, *parameter);
        let there = predict(&moved, data)?;
        let slopes = there.iter().zip(here).map(|(t, h)| (t - h) / step);
        Ok(standardised(slopes, data))
    };
    let columns: Result<Vec<_>, Runaway> = parameters.par_iter().map(column).collect();
    Ok(match &columns?[..] {
        [] => DMatrix::zeros(here.len(), 0),
        columns => DMatrix::from_columns(columns),
    })
}

/// The model with one parameter moved, and by how much of its coordinate: backwards at the upper end of its range.
fn moved(model: &Model, parameter: FreeParameter) -> (Model, f64) {
    let at = parameter.coordinate(model);
    let by = |step: f64| {
        let mut moved = model.clone();
        parameter.set(&mut moved, at + step);
        let step = parameter.coordinate(&moved) - at;
        (moved, step)
    };
    let forwards = by(DIFFERENCE);
    if forwards.1 == 0.0 {
        by(-DIFFERENCE)
    } else {
        forwards
    }
}
