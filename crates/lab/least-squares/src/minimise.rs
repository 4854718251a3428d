//! Nonlinear least squares within bounds: damped Gauss-Newton steps (Levenberg 1944, Marquardt 1963).

use crate::linear::bounded;
use crate::solution::with_diagonal;
use crate::{Bounds, MinimiseError, Prior, Problem, Solution, Termination};
use nalgebra::{DMatrix, DVector};

/// A step is taken if the cost falls by this share of what the linear model expects (Moré, The Levenberg-Marquardt algorithm,
/// 1978).
const ACCEPTED: f64 = 1e-4;
/// The least damping: below it the normal equations' rounding damps more.
const LEAST_DAMPING: f64 = 1e-16;
/// The most: steps are rounding then.
const MOST_DAMPING: f64 = 1e32;

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
    /// Damping of the first step, relative to the squares of the slopes.
    pub first_damping: f64,
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
            first_damping: 1e-3,
        }
    }
}

/// The parameters that make the sum of squares of a problem's residuals (and of the prior's) smallest, near a start.
///
/// Each step solves the linear model of the residuals within the bounds exactly, damped by Nielsen's rule (Damping parameter
/// in Marquardt's method, 1999) in the scale of the slopes, so that the parameters' units do not matter. A point where the
/// residuals have no answer or are not finite rejects the step. The outcome depends on nothing but the arguments.
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
    damping: f64,
    /// What the next rejected step multiplies the damping by.
    growth: f64,
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
            damping: options.first_damping,
            growth: 2.0,
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
        if let Some(end) = self.stationary(&gradient) {
            return self.end(end);
        }
        let step = self.step(&slopes);
        let cost = self.residuals.norm_squared();
        let linear = &slopes * &step;
        // Written so that nothing cancels.
        let expected = -(2.0 * gradient.dot(&step) + linear.norm_squared()) / cost;
        let length = step.component_mul(&self.scale).norm();
        let size = self.at.component_mul(&self.scale).norm();
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
        let taken = gain > ACCEPTED * expected;
        if let Some(trial) = trial.filter(|_| taken) {
            (self.at, self.residuals) = (there, trial);
        }
        self.damp(taken, gain / expected);
        let tolerance = self.options.cost_tolerance;
        if gain.abs() <= tolerance && expected <= tolerance {
            return self.end(Termination::Cost);
        }
        if length <= self.options.step_tolerance * size {
            return self.end(Termination::Step);
        }
        self.follow(taken)
    }

    /// Whether no free parameter lowers the cost.
    fn stationary(&self, gradient: &DVector<f64>) -> Option<Termination> {
        let free = |index: &usize| !self.bounds.blocks(&self.at, gradient, *index);
        let norm = self.residuals.norm();
        let cosine = |index: usize| {
            let length = self.scale[index] * norm;
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

    /// The damped step of the linear model within the bounds.
    fn step(&self, slopes: &DMatrix<f64>) -> DVector<f64> {
        let count = self.at.len();
        // A parameter without any slope stays where it is.
        let scale = self.scale.map(|s| if s > 0.0 { s } else { 1.0 });
        let scaled = DMatrix::from_fn(slopes.nrows(), count, |i, j| slopes[(i, j)] / scale[j]);
        let factors = scaled.qr();
        let mut right = -&self.residuals;
        factors.q_tr_mul(&mut right);
        let r = factors.r();
        let rows = r.nrows();
        let root = DVector::repeat(count, self.damping.sqrt());
        let damped = with_diagonal(&r, &root);
        let right = right
            .rows(0, rows)
            .into_owned()
            .insert_rows(rows, count, 0.0);
        let room = self.bounds.steps_from(&self.at, self.options.longest_step);
        let room =
            Bounds::new((0..count).map(|i| (room.low(i) * scale[i], room.high(i) * scale[i])));
        let step =
            bounded(&damped, &right, &room).expect("damped columns do not depend on each other");
        step.component_div(&scale)
    }

    /// Nielsen's rule.
    fn damp(&mut self, taken: bool, ratio: f64) {
        if taken {
            let factor = 1.0 - (2.0 * ratio - 1.0).powi(3);
            self.damping = (self.damping * factor.max(1.0 / 3.0)).max(LEAST_DAMPING);
            self.growth = 2.0;
        } else {
            self.damping = (self.damping * self.growth).min(MOST_DAMPING);
            self.growth *= 2.0;
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

    /// Computes the Jacobian anew where that is due.
    fn follow(&mut self, taken: bool) -> Option<Termination> {
        let due = match self.options.updates {
            JacobianUpdates::EveryStep => taken,
            JacobianUpdates::Secant { refresh } => {
                self.updates >= refresh.max(1) || (!taken && self.updates > 1)
            }
        };
        if due && self.refresh().is_none() {
            return Some(Termination::NoJacobian);
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
