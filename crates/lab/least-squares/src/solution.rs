//! What a fit ends with.

use nalgebra::{DMatrix, DVector};

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// The residuals are orthogonal to all slopes that bounds leave free.
    Gradient,
    /// A step changed the cost, and was expected to, by no more than the tolerance.
    Cost,
    /// A step was no longer than the tolerance.
    Step,
    /// Every parameter is held by its bounds.
    AllHeld,
    /// The evaluations were used up.
    Evaluations,
    /// The Jacobian has no answer at the best point.
    NoJacobian,
}

impl Termination {
    /// Whether the fit ended at a minimum, as far as its tolerances tell.
    pub fn is_converged(self) -> bool {
        !matches!(self, Self::Evaluations | Self::NoJacobian)
    }
}

/// Why a fit did not begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MinimiseError {
    /// No residuals at the start.
    #[error("the model has no answer where the fit starts")]
    NoResiduals,
    /// No Jacobian at the start.
    #[error("the model has no derivatives where the fit starts")]
    NoJacobian,
}

/// The best point that was found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The parameters, within their bounds.
    pub parameters: DVector<f64>,
    /// The problem's residuals there, without the rows of the prior.
    pub residuals: DVector<f64>,
    /// Sum of squares of all rows, those of the prior too.
    pub cost: f64,
    /// The last Jacobian, without the rows of the prior: of the parameters or of the point one step before them.
    pub jacobian: DMatrix<f64>,
    /// Parameters that a bound holds.
    pub held: Vec<bool>,
    /// How often residuals were computed, those of Jacobians not counted.
    pub evaluations: usize,
    /// How often the Jacobian was computed.
    pub jacobians: usize,
    /// Why it ended there.
    pub termination: Termination,
    /// Slopes of the prior's rows.
    pub(crate) prior: DVector<f64>,
}

impl Solution {
    /// The parameters' covariance where the residuals are in units of their standard deviations: the inverse of `J' J`, with
    /// the prior. A parameter that a bound holds has no variance. `None` where the rows do not determine the others.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let count = self.parameters.len();
        let free: Vec<_> = (0..count).filter(|&i| !self.held[i]).collect();
        let slopes = with_diagonal(&self.jacobian, &self.prior).select_columns(&free);
        let scale = DVector::from_iterator(free.len(), slopes.column_iter().map(|c| c.norm()));
        let scaled = DMatrix::from_fn(slopes.nrows(), slopes.ncols(), |i, j| {
            slopes[(i, j)] / scale[j]
        });
        let inverse = scaled.qr().r().try_inverse()?;
        let inner = &inverse * inverse.transpose();
        if inner.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let mut covariance = DMatrix::zeros(count, count);
        for (i, &row) in free.iter().enumerate() {
            for (j, &column) in free.iter().enumerate() {
                covariance[(row, column)] = inner[(i, j)] / (scale[i] * scale[j]);
            }
        }
        Some(covariance)
    }

    /// Standard errors where the residuals' common standard deviation is unknown and estimated from what is left; `None` as
    /// of [`Solution::covariance`], or where there are no more rows than parameters.
    pub fn standard_errors(&self) -> Option<DVector<f64>> {
        let free = self.held.iter().filter(|held| !**held).count();
        let degrees = self.residuals.len().checked_sub(free).filter(|&n| n > 0)?;
        let variance = self.residuals.norm_squared() / degrees as f64;
        let covariance = self.covariance()?;
        Some(covariance.diagonal().map(|entry| (variance * entry).sqrt()))
    }
}

/// A matrix with a diagonal one below it.
pub(crate) fn with_diagonal(matrix: &DMatrix<f64>, diagonal: &DVector<f64>) -> DMatrix<f64> {
    let rows = matrix.nrows();
    let mut whole = matrix.clone().insert_rows(rows, diagonal.len(), 0.0);
    for (index, entry) in diagonal.iter().enumerate() {
        whole[(rows + index, index)] = *entry;
    }
    whole
}
