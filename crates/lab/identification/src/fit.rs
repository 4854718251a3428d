//! Least squares of a model's parameters to a session.

use crate::base::{identifiable, seeds};
use crate::dataset::{Dataset, rms};
use crate::heater;
use crate::parameter::{BaseParameter, FreeParameter};
use crate::prediction::{jacobian, predict, standard_deviation, standardised};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use mirror_model::{Model, Runaway, Symbol};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

/// Standard deviation of the prior of every coordinate, about the start: a factor of 20 for a base parameter. It keeps what the
/// data do not determine where it was, and weighs nothing against hundreds of readings.
const PRIOR: f64 = 3.0;
/// A fit ends where a step lowers the sum of squares, or moves, by no more than this share: of several starts, and of the best
/// one, whose figures are printed to four digits.
const ROUGH: f64 = 1e-3;
const FINE: f64 = 1e-6;
/// A time constant is not known to a factor of e where all standardised residuals together change by less than this with its
/// logarithm: its standard error is above 1.
const IDLE: f64 = 1.0;

/// The parameters that a session can identify in a model, with those of its effects. A time constant of 0 is none.
pub fn free_parameters(model: &Model, data: &Dataset) -> Vec<FreeParameter> {
    let base = identifiable(data)
        .into_iter()
        .filter(|parameter| parameter.get(model) > 0.0)
        .map(FreeParameter::Base);
    let effects =
        model.effects.iter().enumerate().flat_map(|(e, active)| {
            (0..active.values.len()).map(move |p| FreeParameter::Effect(e, p))
        });
    base.chain(effects).collect()
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with the best values.
    pub model: Model,
    /// What was fitted.
    pub knobs: Vec<FreeParameter>,
    /// Measured less predicted, in um and A.
    pub residuals: Vec<f64>,
}

impl Fitted {
    /// The standardised residuals: each in units of its standard deviation about the prediction.
    pub fn scaled(&self, data: &Dataset) -> DVector<f64> {
        standardised(self.residuals.iter().copied(), data)
    }

    /// Root mean square of what is left of the displacements (um) or of the currents (A), if they were measured.
    pub fn rms(&self, data: &Dataset, displacement: bool) -> Option<f64> {
        let left = self.residuals.iter().copied().zip(&data.observations);
        rms(left, displacement)
    }

    /// The sum of squares of the standardised residuals.
    pub fn cost(&self, data: &Dataset) -> f64 {
        self.scaled(data).iter().map(|r| r * r).sum()
    }
}

struct Problem<'a> {
    data: &'a Dataset,
    model: Model,
    parameters: &'a [FreeParameter],
    start: DVector<f64>,
    at: DVector<f64>,
    values: &'a [f64],
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.at.clone_from(x);
        for (parameter, &coordinate) in self.parameters.iter().zip(x.iter()) {
            parameter.set(&mut self.model, coordinate);
        }
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        // A step into a runaway is a bad step, and not the end.
        let predicted = predict(&self.model, self.data)
            .unwrap_or_else(|_| vec![1e6; self.data.observations.len()]);
        let rows = predicted
            .iter()
            .zip(self.values)
            .zip(&self.data.observations)
            .map(|((p, v), o)| (p - v) / standard_deviation(o));
        let prior = self
            .at
            .iter()
            .zip(self.start.iter())
            .map(|(at, start)| (at - start) / PRIOR);
        Some(DVector::from_vec(rows.chain(prior).collect()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let data = jacobian(&self.model, self.data, self.parameters).ok()?;
        let (rows, columns) = data.shape();
        let mut whole = data.insert_rows(rows, columns, 0.0);
        for index in 0..columns {
            whole[(rows + index, index)] = 1.0 / PRIOR;
        }
        Some(whole)
    }
}

/// Fits a model to a dataset's observations, from several starts.
///
/// # Errors
/// [`Runaway`] if the model that it starts from, or the best one, has no finite answer.
pub fn fit(model: &Model, data: &Dataset) -> Result<Fitted, Runaway> {
    let model = heater::suited(model, data);
    let starts = seeds(&model, &identifiable(data), data);
    let parameters = free_parameters(&starts[0], data);
    let fitted = best_fit(&starts, data, &data.values(), &parameters)?;
    without_idle_time(fitted, &model, data)
}

/// The fit without the time constant that none of a heater's readings depends on, which stays where the model has it.
fn without_idle_time(mut fitted: Fitted, model: &Model, data: &Dataset) -> Result<Fitted, Runaway> {
    let time = BaseParameter::Shared(Symbol::FastTime);
    let parameter = FreeParameter::Base(time);
    if !data.is_of_heaters() || !fitted.knobs.contains(&parameter) {
        return Ok(fitted);
    }
    let slopes = jacobian(&fitted.model, data, &[parameter])?;
    if slopes.norm() < IDLE {
        time.set(&mut fitted.model, time.get(model));
        fitted.knobs.retain(|other| *other != parameter);
    }
    Ok(fitted)
}

/// The best of the fits from several starts.
///
/// # Errors
/// As [`fit`], if no start leads anywhere.
pub fn best_fit(
    starts: &[Model],
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
) -> Result<Fitted, Runaway> {
    let fits: Vec<_> = starts
        .par_iter()
        .map(|start| minimised(start, data, values, parameters, ROUGH))
        .collect();
    let cost = |fit: &Result<Fitted, Runaway>| {
        fit.as_ref()
            .map_or(f64::INFINITY, |fitted| fitted.cost(data))
    };
    let best = fits.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let best = best.expect("a fit has at least one start")?;
    minimised(&best.model, data, values, parameters, FINE)
}

/// Fits chosen parameters of a model to numbers in the place of a dataset's own, from one start.
///
/// # Errors
/// As [`fit`].
pub fn fit_parameters(
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
) -> Result<Fitted, Runaway> {
    minimised(start, data, values, parameters, FINE)
}

fn minimised(
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
    tolerance: f64,
) -> Result<Fitted, Runaway> {
    let at = DVector::from_iterator(
        parameters.len(),
        parameters
            .iter()
            .map(|parameter| parameter.coordinate(start)),
    );
    let problem = Problem {
        data,
        model: start.clone(),
        parameters,
        start: at.clone(),
        at,
        values,
    };
    let (problem, _) = LevenbergMarquardt::new()
        .with_ftol(tolerance)
        .with_xtol(tolerance)
        .with_patience(12)
        .minimize(problem);
    let residuals = values
        .iter()
        .zip(predict(&problem.model, data)?)
        .map(|(value, predicted)| value - predicted)
        .collect();
    Ok(Fitted {
        model: problem.model,
        knobs: parameters.to_vec(),
        residuals,
    })
}
