//! What is fitted.

use crate::Bounds;
use crate::differences::{DifferenceStep, forward_differences};
use nalgebra::{DMatrix, DVector};

/// Residuals of a model as a function of its parameters.
pub trait Problem {
    /// The residuals (predicted less measured, each in units of its standard deviation), as many at every point; `None`, or
    /// a number that is not finite, where the model has no answer.
    fn residuals(&self, parameters: &DVector<f64>) -> Option<DVector<f64>>;

    /// How each residual (row) changes with each parameter (column) at a point with residuals `here`; `None` where that has
    /// no answer.
    ///
    /// Unless a problem knows better (derivatives, columns in parallel) these are forward differences.
    fn jacobian(
        &self,
        parameters: &DVector<f64>,
        here: &DVector<f64>,
        bounds: &Bounds,
    ) -> Option<DMatrix<f64>> {
        let step = self.difference_step();
        forward_differences(|at| self.residuals(at), parameters, here, bounds, step)
    }

    /// The step of those differences.
    fn difference_step(&self) -> DifferenceStep {
        DifferenceStep::FORWARD
    }
}

/// A function of the parameters is a problem whose Jacobian is taken by forward differences.
impl<F: Fn(&DVector<f64>) -> Option<DVector<f64>>> Problem for F {
    fn residuals(&self, parameters: &DVector<f64>) -> Option<DVector<f64>> {
        self(parameters)
    }
}

/// What is known of the parameters beforehand: independent normal distributions. Each is one more row of the problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Means.
    pub mean: DVector<f64>,
    /// Standard deviations; infinite where nothing is known.
    pub standard_deviation: DVector<f64>,
}

impl Prior {
    /// The same standard deviation for every parameter.
    pub fn around(mean: DVector<f64>, standard_deviation: f64) -> Self {
        let standard_deviation = DVector::repeat(mean.len(), standard_deviation);
        Self {
            mean,
            standard_deviation,
        }
    }

    pub(crate) fn residuals(&self, parameters: &DVector<f64>) -> DVector<f64> {
        (parameters - &self.mean).component_div(&self.standard_deviation)
    }

    pub(crate) fn slopes(&self) -> DVector<f64> {
        self.standard_deviation.map(f64::recip)
    }
}
