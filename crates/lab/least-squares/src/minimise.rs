//! Nonlinear least squares within bounds: damped Gauss-Newton steps (Levenberg 1944, Marquardt 1963).

use crate::linear_model::LinearModel;
use crate::solution::with_diagonal;
use crate::{Bounds, MinimiseError, Prior, Problem, Solution, Termination};
use nalgebra::{DMatrix, DVector};

/// A step is taken if the cost falls by this share of what the linear model expects (Moré 1978).
const ACCEPTED: f64 = 1e-4;
/// The trust region grows to twice a step whose gain is this share or more of what was expected, and shrinks after a step
/// whose gain is that share or less (Moré 1978).
const GOOD: f64 = 0.75;
const POOR: f64 = 0.25;
/// How it shrinks: to the minimum of the parabola through what is known along the step, within these shares (Moré 1978).
const SHRINK: (f64, f64) = (0.1, 0.5);
/// A damped step need not reach the edge of the trust region closer than this (Moré 1978).
const EDGE: f64 = 0.1;
/// The damping of a step that the trust region does not limit, relative to the squares of the slopes: the square of 1e-14,
/// which keeps columns that depend on each other to rounding from being divided by it.
const LEAST_DAMPING: f64 = 1e-28;
/// Trials of the damping: secants of the nearly linear 1/length take two or three.
const MOST_TRIALS: usize = 50;

/// How the Jacobian follows the steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JacobianUpdates {
    /// Computed anew after every step that is taken.
    EveryStep,
    /// Corrected after every step by Broyden's secant update (Broyden 1965, in the parameters' scale), and computed anew after
    /// so many, after a rejected step, and before a fit with a Jacobian of other origin ends.
    Secant {
        /// Steps between two computations, at least one.
        refresh: usize,
    },
}

/// How a fit runs.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where the parameters stay; `None` for everywhere.
    pub bounds: Option<Bounds>,
    /// What is known of them beforehand.
    pub prior: Option<Prior>,
    /// How the Jacobian follows the steps.
    pub updates: JacobianUpdates,
    /// A Jacobian to begin with, of a point or a problem close by, without the prior's rows.
    pub first_jacobian: Option<DMatrix<f64>>,
    /// The fit ends where a step lowers the cost, and is expected to, by this share or less.
    pub cost_tolerance: f64,
    /// The fit ends where a step is this share of the parameters or less, both in the scale of the slopes.
    pub step_tolerance: f64,
    /// The fit ends where the cosine between the residuals and every free slope is this or less.
    pub gradient_tolerance: f64,
    /// Residuals are computed so often at most, those of Jacobians not counted.
    pub max_evaluations: usize,
    /// No parameter changes by more than this in one step, in its own unit.
    pub longest_step: f64,
    /// Length of the first step at most, relative to the parameters, both in the scale of the slopes.
    pub first_radius: f64,
}

impl Default for Options {
    /// No bounds, no prior, a Jacobian every step, and all the digits that forward differences can give.
    fn default() -> Self {
        Self {
            bounds: None,
            prior: None,
            updates: JacobianUpdates::EveryStep,
            first_jacobian: None,
            cost_tolerance: 1e-10,
            step_tolerance: 1e-10,
            gradient_tolerance: 1e-10,
            max_evaluations: 1000,
            longest_step: f64::INFINITY,
            first_radius: 1.0,
        }
    }
}

/// The parameters that make the sum of squares of a problem's residuals (and of the prior's) smallest, near a start.
///
/// Each step solves the linear model of the residuals within the bounds exactly, damped so that it stays in a trust region
/// (Moré, The Levenberg-Marquardt algorithm: implementation and theory, 1978). All lengths are in the scale of the slopes, so
/// the parameters' units do not matter. A point where the residuals have no answer or are not finite rejects the step. The
/// outcome depends on nothing but the arguments.
///
/// # Errors
/// Where the start, clamped to the bounds, has no residuals or no Jacobian.
///
/// # Panics
/// If bounds, prior or first Jacobian are of another number of parameters.
pub fn minimise(
    problem: &(impl Problem + ?Sized),
    start: &DVector<f64>,
    options: &Options,
) -> Result<Solution, MinimiseError> {
    let mut search = Search::new(problem, start, options)?;
    loop {
        if let Some(termination) = search.round() {
            return Ok(search.conclude(termination));
        }
    }
}

struct Search<'a, P: ?Sized> {
    problem: &'a P,
    options: &'a Options,
    bounds: Bounds,
    at: DVector<f64>,
    /// Residuals, then those of the prior.
    residuals: DVector<f64>,
    /// Slopes of the problem's residuals.
    jacobian: DMatrix<f64>,
    /// Slopes of the prior's, a diagonal.
    prior: DVector<f64>,
    /// The longest that each column has been (Moré 1978).
    scale: DVector<f64>,
    /// Length that a step may have, in the scale of the slopes.
    radius: f64,
    evaluations: usize,
    jacobians: usize,
    /// Secant updates since the Jacobian was computed, or since the start.
    updates: usize,
}

impl<'a, P: Problem + ?Sized> Search<'a, P> {
    fn new(
        problem: &'a P,
        start: &DVector<f64>,
        options: &'a Options,
    ) -> Result<Self, MinimiseError> {
        let count = start.len();
        let bounds = options.bounds.clone().unwrap_or(Bounds::none(count));
        assert_eq!(bounds.len(), count, "as many bounds as parameters");
        let prior = options.prior.as_ref();
        let prior = prior.map_or(DVector::zeros(count), Prior::slopes);
        let mut search = Self {
            problem,
            options,
            at: bounds.clamp(start),
            bounds,
            residuals: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, count),
            prior,
            scale: DVector::zeros(count),
            radius: 0.0,
            evaluations: 0,
            jacobians: 0,
            updates: 0,
        };
        let here = search.evaluate(&search.at.clone());
        search.residuals = here.ok_or(MinimiseError::NoResiduals)?;
        match &options.first_jacobian {
            Some(jacobian) => search.jacobian.clone_from(jacobian),
            None => search.refresh().ok_or(MinimiseError::NoJacobian)?,
        }
        search.rescale();
        let size = search.length(&search.at);
        search.radius = options.first_radius * if size > 0.0 { size } else { 1.0 };
        Ok(search)
    }

    /// All rows at a point, if they are numbers.
    fn evaluate(&mut self, at: &DVector<f64>) -> Option<DVector<f64>> {
        self.evaluations += 1;
        let data = self.problem.residuals(at)?;
        let prior = self.options.prior.as_ref();
        let prior = prior.map_or(DVector::zeros(at.len()), |prior| prior.residuals(at));
        let rows = data.iter().chain(prior.iter()).copied();
        let rows = DVector::from_iterator(data.len() + prior.len(), rows);
        rows.norm_squared().is_finite().then_some(rows)
    }

    fn data(&self) -> DVector<f64> {
        let rows = self.residuals.len() - self.at.len();
        self.residuals.rows(0, rows).into_owned()
    }

    fn refresh(&mut self) -> Option<()> {
        self.jacobians += 1;
        let jacobian = self
            .problem
            .jacobian(&self.at, &self.data(), &self.bounds)?;
        if jacobian.iter().any(|slope| !slope.is_finite()) {
            return None;
        }
        self.jacobian = jacobian;
        self.updates = 0;
        Some(())
    }

    fn rescale(&mut self) {
        for (index, column) in self.jacobian.column_iter().enumerate() {
            let length = column.norm().hypot(self.prior[index]);
            self.scale[index] = self.scale[index].max(length);
        }
    }

    /// One step, taken or not; or the end.
    fn round(&mut self) -> Option<Termination> {
        let slopes = with_diagonal(&self.jacobian, &self.prior);
        let gradient = slopes.tr_mul(&self.residuals);
        if let Some(end) = self.stationary(&slopes, &gradient) {
            return self.end(end);
        }
        let (step, is_limited) = self.step(&slopes);
        let cost = self.residuals.norm_squared();
        let linear = &slopes * &step;
        // Written so that nothing cancels.
        let expected = -(2.0 * gradient.dot(&step) + linear.norm_squared()) / cost;
        let (length, size) = (self.length(&step), self.length(&self.at));
        if self.evaluations >= self.options.max_evaluations {
            return Some(Termination::Evaluations);
        }
        let there = self.bounds.clamp(&(&self.at + &step));
        let trial = self.evaluate(&there);
        let gain = trial
            .as_ref()
            .map_or(f64::NEG_INFINITY, |trial| 1.0 - trial.norm_squared() / cost);
        if let Some(trial) = &trial {
            self.learn(&(trial - &self.residuals - linear), &step);
        }
        let taken = trial.filter(|_| gain > ACCEPTED * expected);
        let before = taken.map(|trial| {
            let at = std::mem::replace(&mut self.at, there);
            (at, std::mem::replace(&mut self.residuals, trial))
        });
        let slope = 2.0 * gradient.dot(&step) / cost;
        self.trust(length, is_limited, gain, expected, slope);
        let tolerance = self.options.cost_tolerance;
        if gain.abs() <= tolerance && expected <= tolerance {
            return self.end(Termination::Cost);
        }
        if length <= self.options.step_tolerance * size {
            return self.end(Termination::Step);
        }
        self.follow(before, length)
    }

    /// Whether no free parameter lowers the cost.
    fn stationary(&self, slopes: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<Termination> {
        let free = |index: &usize| !self.bounds.blocks(&self.at, gradient, *index);
        let norm = self.residuals.norm();
        let cosine = |index: usize| {
            let length = slopes.column(index).norm() * norm;
            if length > 0.0 {
                gradient[index].abs() / length
            } else {
                0.0
            }
        };
        let mut held = true;
        let mut steepest = 0.0_f64;
        for index in (0..self.at.len()).filter(free) {
            held = false;
            steepest = steepest.max(cosine(index));
        }
        match (held, steepest <= self.options.gradient_tolerance) {
            (true, _) => Some(Termination::AllHeld),
            (false, true) => Some(Termination::Gradient),
            (false, false) => None,
        }
    }

    /// Length of a step in the scale of the slopes.
    fn length(&self, step: &DVector<f64>) -> f64 {
        step.component_mul(&self.scale).norm()
    }

    /// The step of the linear model within bounds and trust region, and whether the latter limits it.
    ///
    /// The more damping, the shorter the step: a damping is sought that leaves about the region's radius. The inverse of the
    /// length is nearly linear in it (Hebden 1973), so secants find it, held inside a bracket.
    fn step(&self, slopes: &DMatrix<f64>) -> (DVector<f64>, bool) {
        let model = LinearModel::new(slopes, &self.residuals, &self.scale);
        let room = model.room(&self.bounds.steps_from(&self.at, self.options.longest_step));
        let step = model.step(LEAST_DAMPING, &room);
        let excess = |step: &DVector<f64>| 1.0 / step.norm() - 1.0 / self.radius;
        if step.norm() <= (1.0 + EDGE) * self.radius {
            return (model.unscaled(&step), false);
        }
        let mut low = (LEAST_DAMPING, excess(&step));
        let mut high = (model.gradient_norm() / self.radius, f64::NAN);
        let mut damping = 1e-3 * high.0;
        for _ in 0..MOST_TRIALS {
            let step = model.step(damping, &room);
            if (step.norm() / self.radius - 1.0).abs() <= EDGE {
                return (model.unscaled(&step), true);
            }
            let excess = excess(&step);
            if excess < 0.0 {
                low = (damping, excess);
            } else {
                high = (damping, excess);
            }
            let secant = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
            let middle = (low.0 * high.0).sqrt();
            let inside = secant > 1.01 * low.0 && secant < 0.99 * high.0;
            damping = if inside { secant } else { middle };
        }
        (model.unscaled(&model.step(high.0, &room)), true)
    }

    /// How far the linear model is trusted after a step of a `length` that changed the cost by `-gain` (relative), where
    /// `-expected` was expected and the cost's `slope` along the step is known.
    fn trust(&mut self, length: f64, is_limited: bool, gain: f64, expected: f64, slope: f64) {
        let ratio = gain / expected;
        if ratio <= POOR || ratio.is_nan() {
            let parabola = if gain.is_finite() {
                0.5 * slope / (slope + gain)
            } else {
                0.0
            };
            let share = if gain >= 0.0 { SHRINK.1 } else { parabola };
            self.radius = share.clamp(SHRINK.0, SHRINK.1) * self.radius.min(length / SHRINK.0);
        } else if ratio >= GOOD || !is_limited {
            self.radius = 2.0 * length;
        }
    }

    /// Broyden's update: the least change of the slopes, in the parameters' scale, that explains a surprise.
    fn learn(&mut self, surprise: &DVector<f64>, step: &DVector<f64>) {
        if self.options.updates == JacobianUpdates::EveryStep {
            return;
        }
        let weighted = step.component_mul(&self.scale).component_mul(&self.scale);
        let square = weighted.dot(step);
        if square > 0.0 {
            let rows = self.jacobian.nrows();
            self.jacobian += surprise.rows(0, rows) * weighted.transpose() / square;
            self.updates += 1;
        }
    }

    /// Computes the Jacobian anew where that is due. `before` is where a step of this length came from: one that leads to
    /// where the model has no slopes is not taken after all.
    fn follow(
        &mut self,
        before: Option<(DVector<f64>, DVector<f64>)>,
        length: f64,
    ) -> Option<Termination> {
        let due = match self.options.updates {
            JacobianUpdates::EveryStep => before.is_some(),
            JacobianUpdates::Secant { refresh } => {
                self.updates >= refresh.max(1) || (before.is_none() && self.updates > 1)
            }
        };
        if due && self.refresh().is_none() {
            let Some((at, residuals)) = before else {
                return Some(Termination::NoJacobian);
            };
            (self.at, self.residuals) = (at, residuals);
            self.radius = SHRINK.0 * length;
        }
        self.rescale();
        None
    }

    /// A Jacobian that was computed for another point or problem is no reason to end.
    fn end(&mut self, termination: Termination) -> Option<Termination> {
        if self.jacobians > 0 {
            return Some(termination);
        }
        match self.refresh() {
            Some(()) => {
                self.rescale();
                None
            }
            None => Some(Termination::NoJacobian),
        }
    }

    fn conclude(self, termination: Termination) -> Solution {
        let gradient = with_diagonal(&self.jacobian, &self.prior).tr_mul(&self.residuals);
        let count = self.at.len();
        Solution {
            residuals: self.data(),
            cost: self.residuals.norm_squared(),
            held: (0..count)
                .map(|index| self.bounds.blocks(&self.at, &gradient, index))
                .collect(),
            parameters: self.at,
            jacobian: self.jacobian,
            evaluations: self.evaluations,
            jacobians: self.jacobians,
            termination,
            prior: self.prior,
        }
    }
}
