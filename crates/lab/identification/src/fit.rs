//! Least squares of a model's parameters to a session.

use crate::base::{Free, identifiable, seeds};
use crate::heater;
use crate::plan::{Channel, Plan, rms};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use mirror_model::{Model, Runaway, simulate};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

/// Step control of the simulation in units of the time since the last jump.
pub const RESOLUTION: f64 = 0.5;
/// What lumped equations cannot follow of a mirror with distributed heat, so that no single reading is trusted beyond it.
const APPROXIMATION_UM: f64 = 0.1;
const APPROXIMATION_RATIO: f64 = 3e-4;
/// Parameters are fitted as logarithms; a prior this wide keeps what the data do not determine where it was.
const PRIOR: f64 = 3.0;
/// What a model without an answer predicts (um, A): far beyond anything measured.
const RUNAWAY: f64 = 1e6;
/// A fit ends where a step gains, or moves, no more than this share: of several starts, and of the best one.
const ROUGH: f64 = 1e-3;
const FINE: f64 = 1e-6;
/// Difference step of a logarithm.
const DIFFERENCE: f64 = 1e-4;

/// A number that is fitted: a parameter of the base, or of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// A base parameter, fitted as its logarithm.
    Base(Free),
    /// Parameter `.1` of the model's effect `.0`, fitted in units of its usual size.
    Effect(usize, usize),
}

impl Knob {
    /// Its name for people.
    pub fn name(self, model: &Model) -> String {
        match self {
            Self::Base(free) => free.name(),
            Self::Effect(effect, index) => {
                let active = &model.effects[effect];
                format!(
                    "{}.{}",
                    active.id(),
                    active.effect.info().parameters[index].symbol
                )
            }
        }
    }

    /// Its unit.
    pub fn unit(self, model: &Model) -> String {
        match self {
            Self::Base(free) => free.symbol().entry().unit.into(),
            Self::Effect(effect, index) => model.effects[effect].effect.info().parameters[index]
                .unit
                .to_string(),
        }
    }

    /// Its value in its unit.
    pub fn value(self, model: &Model) -> f64 {
        match self {
            Self::Base(free) => free.get(model),
            Self::Effect(effect, index) => model.effects[effect].values[index],
        }
    }

    /// How much its value changes with its coordinate.
    pub fn scale(self, model: &Model) -> f64 {
        match self {
            Self::Base(free) => free.get(model),
            Self::Effect(effect, index) => model.effects[effect].effect.info().parameters[index]
                .start
                .abs(),
        }
    }

    /// Whether a fit has driven it to the end of what is plausible.
    pub fn is_at_its_limit(self, model: &Model) -> bool {
        let value = self.value(model);
        let (low, high) = match self {
            Self::Base(free) => free.range(),
            Self::Effect(effect, index) => {
                let parameter = &model.effects[effect].effect.info().parameters[index];
                (parameter.low, parameter.high)
            }
        };
        let room = 1e-3 * (high - low);
        value <= low + room.min(1e-3 * value.abs()) || value >= high - room
    }

    fn coordinate(self, model: &Model) -> f64 {
        match self {
            Self::Base(free) => free.get(model).ln(),
            Self::Effect(..) => self.value(model) / self.scale(model),
        }
    }

    /// Moves it by a step of its coordinate.
    pub fn shift(self, model: &mut Model, step: f64) {
        let at = self.coordinate(model);
        self.set(model, at + step);
    }

    fn set(self, model: &mut Model, coordinate: f64) {
        match self {
            Self::Base(free) => {
                let (low, high) = free.range();
                free.set(model, coordinate.exp().clamp(low.max(1e-12), high));
            }
            Self::Effect(effect, index) => {
                let scale = self.scale(model);
                let active = &mut model.effects[effect];
                let parameter = &active.effect.info().parameters[index];
                active.values[index] = (coordinate * scale).clamp(parameter.low, parameter.high);
            }
        }
    }
}

/// The parameters that a session can identify in a model, with those of its effects. A time constant of 0 is none.
pub fn knobs(model: &Model, plan: &Plan) -> Vec<Knob> {
    let base = identifiable(plan)
        .into_iter()
        .filter(|free| free.get(model) > 0.0)
        .map(Knob::Base);
    let effects = model
        .effects
        .iter()
        .enumerate()
        .flat_map(|(e, active)| (0..active.values.len()).map(move |p| Knob::Effect(e, p)));
    base.chain(effects).collect()
}

/// What a fit trusts one observation to, one standard deviation.
pub fn trust(observation: &crate::plan::Observation) -> f64 {
    let approximation = match observation.channel {
        Channel::Displacement => APPROXIMATION_UM,
        Channel::Current(_) => APPROXIMATION_RATIO * observation.value.abs(),
    };
    observation.noise.hypot(approximation)
}

/// Numbers like a plan's observations, in um and A, in units of trust.
pub fn in_units_of_trust(numbers: impl IntoIterator<Item = f64>, plan: &Plan) -> DVector<f64> {
    let rows = numbers
        .into_iter()
        .zip(&plan.observations)
        .map(|(number, observation)| number / trust(observation));
    DVector::from_iterator(plan.observations.len(), rows)
}

/// The white noise of a plan's observations, one standard deviation each, in units of trust.
pub fn white_noise(plan: &Plan) -> DVector<f64> {
    in_units_of_trust(plan.observations.iter().map(|o| o.noise), plan)
}

/// A model's predictions of a plan's observations.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn predict(model: &Model, plan: &Plan) -> Result<Vec<f64>, Runaway> {
    Ok(plan.read(&simulate(model, &plan.intervals, RESOLUTION)?))
}

/// How predictions, in units of trust, change with each knob's coordinate.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer close by.
pub fn jacobian(model: &Model, plan: &Plan, knobs: &[Knob]) -> Result<DMatrix<f64>, Runaway> {
    let here = predict(model, plan)?;
    let columns: Result<Vec<_>, Runaway> = knobs
        .par_iter()
        .map(|knob| {
            let mut moved = model.clone();
            let at = knob.coordinate(model);
            knob.set(&mut moved, at + DIFFERENCE);
            let mut step = knob.coordinate(&moved) - at;
            if step == 0.0 {
                knob.set(&mut moved, at - DIFFERENCE);
                step = knob.coordinate(&moved) - at;
            }
            let there = predict(&moved, plan)?;
            let slopes = there
                .iter()
                .zip(&here)
                .zip(&plan.observations)
                .map(|((t, h), o)| (t - h) / (step * trust(o)));
            Ok(DVector::from_iterator(here.len(), slopes))
        })
        .collect();
    Ok(DMatrix::from_columns(&columns?))
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with the best values.
    pub model: Model,
    /// What was fitted.
    pub knobs: Vec<Knob>,
    /// Measured less predicted, in um and A.
    pub residuals: Vec<f64>,
}

impl Fitted {
    /// The residuals in units of trust.
    pub fn scaled(&self, plan: &Plan) -> DVector<f64> {
        in_units_of_trust(self.residuals.iter().copied(), plan)
    }

    /// Root mean square of what is left of the displacements (um) or of the currents (A), if they were measured.
    pub fn rms(&self, plan: &Plan, displacement: bool) -> Option<f64> {
        let left = self.residuals.iter().copied().zip(&plan.observations);
        rms(left, displacement)
    }

    /// The sum of squares of the residuals in units of trust.
    pub fn cost(&self, plan: &Plan) -> f64 {
        self.scaled(plan).iter().map(|r| r * r).sum()
    }
}

struct Problem<'a> {
    plan: &'a Plan,
    model: Model,
    knobs: &'a [Knob],
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
        for (knob, &coordinate) in self.knobs.iter().zip(x.iter()) {
            knob.set(&mut self.model, coordinate);
        }
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        // A step into a runaway is a bad step, and not the end.
        let predicted = predict(&self.model, self.plan)
            .unwrap_or_else(|_| vec![RUNAWAY; self.plan.observations.len()]);
        let rows = predicted
            .iter()
            .zip(self.values)
            .zip(&self.plan.observations)
            .map(|((p, v), o)| (p - v) / trust(o));
        let prior = self
            .at
            .iter()
            .zip(self.start.iter())
            .map(|(at, start)| (at - start) / PRIOR);
        Some(DVector::from_vec(rows.chain(prior).collect()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let data = jacobian(&self.model, self.plan, self.knobs).ok()?;
        let (rows, columns) = data.shape();
        let mut whole = data.insert_rows(rows, columns, 0.0);
        for index in 0..columns {
            whole[(rows + index, index)] = 1.0 / PRIOR;
        }
        Some(whole)
    }
}

/// Fits a model to a plan's observations.
///
/// # Errors
/// [`Runaway`] if the model that it starts from, or the best one, has no finite answer.
pub fn fit(model: &Model, plan: &Plan) -> Result<Fitted, Runaway> {
    let model = heater::suited(model, plan);
    let starts = seeds(&model, &identifiable(plan), plan);
    let knobs = knobs(&starts[0], plan);
    let fitted = best_fit(&starts, plan, &plan.values(), &knobs)?;
    heater::without_idle_time(fitted, &model, plan)
}

/// The best of the fits from several starts.
///
/// # Errors
/// As [`fit`], if no start leads anywhere.
pub fn best_fit(
    starts: &[Model],
    plan: &Plan,
    values: &[f64],
    knobs: &[Knob],
) -> Result<Fitted, Runaway> {
    let fits: Vec<_> = starts
        .par_iter()
        .map(|start| minimised(start, plan, values, knobs, ROUGH))
        .collect();
    let cost = |fit: &Result<Fitted, Runaway>| {
        fit.as_ref()
            .map_or(f64::INFINITY, |fitted| fitted.cost(plan))
    };
    let best = fits.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let best = best.expect("a fit has at least one start")?;
    minimised(&best.model, plan, values, knobs, FINE)
}

/// Fits chosen knobs of a model to numbers in the place of a plan's own.
///
/// # Errors
/// As [`fit`].
pub fn fit_knobs(
    start: &Model,
    plan: &Plan,
    values: &[f64],
    knobs: &[Knob],
) -> Result<Fitted, Runaway> {
    minimised(start, plan, values, knobs, FINE)
}

fn minimised(
    start: &Model,
    plan: &Plan,
    values: &[f64],
    knobs: &[Knob],
    tolerance: f64,
) -> Result<Fitted, Runaway> {
    let at = DVector::from_iterator(knobs.len(), knobs.iter().map(|knob| knob.coordinate(start)));
    let problem = Problem {
        plan,
        model: start.clone(),
        knobs,
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
        .zip(predict(&problem.model, plan)?)
        .map(|(value, predicted)| value - predicted)
        .collect();
    Ok(Fitted {
        model: problem.model,
        knobs: knobs.to_vec(),
        residuals,
    })
}
