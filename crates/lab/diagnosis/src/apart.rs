//! How far the predictions of two effects are apart beyond what a fit hides: that of the base, and of the effect that is not nature's. A
//! film that is squeezed by as much everywhere is a sensor's lag, however its own values differ from those of one.

use crate::residual_space::{Kind, ResidualSpace};
use identification::dataset::Dataset;
use identification::parameter::FreeParameter;
use identification::prediction::{jacobian, predict, standardised};
use mirror_model::effect::Active;
use mirror_model::{Model, Runaway};
use nalgebra::DMatrix;

/// The most of what either of two effects leaves of the other's predictions when it is added to a model in the other's place and fitted with the
/// base, by slopes: standard deviations of one reading. `space` makes the space in which a fit with these derivatives is free.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer with one of them.
pub(crate) fn apart<K: Kind>(
    model: &Model,
    data: &Dataset,
    base: &[FreeParameter],
    effects: [&Active; 2],
    space: impl Fn(&DMatrix<f64>) -> ResidualSpace<K>,
) -> Result<f64, Runaway> {
    let [first, second] = effects.map(|active| with(model, active));
    let differences = predict(&first, data)?
        .into_iter()
        .zip(predict(&second, data)?);
    let difference = standardised(differences.map(|(a, b)| a - b), data);
    let of_base = jacobian(model, data, base)?;
    let mut most: f64 = 0.0;
    for rival in [&first, &second] {
        let own = jacobian(rival, data, &parameters_of_the_last(rival))?;
        let columns: Vec<_> = of_base.column_iter().chain(own.column_iter()).collect();
        let left = space(&DMatrix::from_columns(&columns)).vector(&difference);
        most = most.max(left.norm_squared().max(0.0).sqrt());
    }
    Ok(most)
}

fn with(model: &Model, active: &Active) -> Model {
    let mut with = model.clone();
    with.effects.push(active.clone());
    with
}

/// The parameters of a model's last effect.
fn parameters_of_the_last(model: &Model) -> Vec<FreeParameter> {
    let last = model.effects.len() - 1;
    let count = model.effects[last].values.len();
    (0..count)
        .map(|index| FreeParameter::Effect(last, index))
        .collect()
}
