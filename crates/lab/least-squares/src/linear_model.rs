//! What a step of the search is taken on: the residuals, as if they were linear.

use crate::Bounds;
use crate::linear::bounded;
use crate::solution::with_diagonal;
use nalgebra::{DMatrix, DVector};

/// The residuals as a linear function of a step, in scaled coordinates and reduced to as many rows as parameters.
pub(crate) struct LinearModel {
    scale: DVector<f64>,
    r: DMatrix<f64>,
    right: DVector<f64>,
}

impl LinearModel {
    /// Of these slopes and residuals, each parameter measured in its scale.
    pub(crate) fn new(
        slopes: &DMatrix<f64>,
        residuals: &DVector<f64>,
        scale: &DVector<f64>,
    ) -> Self {
        // A parameter without any slope stays where it is.
        let scale = scale.map(|s| if s > 0.0 { s } else { 1.0 });
        let scaled = DMatrix::from_fn(slopes.nrows(), slopes.ncols(), |i, j| {
            slopes[(i, j)] / scale[j]
        });
        let factors = scaled.qr();
        let mut right = -residuals;
        factors.q_tr_mul(&mut right);
        let r = factors.r();
        let right = right.rows(0, r.nrows()).into_owned();
        Self { scale, r, right }
    }

    /// Where a step may end, in these coordinates.
    pub(crate) fn room(&self, steps: &Bounds) -> Bounds {
        let room = |i: usize| (steps.low(i) * self.scale[i], steps.high(i) * self.scale[i]);
        Bounds::new((0..steps.len()).map(room))
    }

    /// How steep the cost is where the step begins.
    pub(crate) fn gradient_norm(&self) -> f64 {
        self.r.tr_mul(&self.right).norm()
    }

    /// The step that is best with such a damping.
    pub(crate) fn step(&self, damping: f64, room: &Bounds) -> DVector<f64> {
        let count = self.scale.len();
        let damped = with_diagonal(&self.r, &DVector::repeat(count, damping.sqrt()));
        let rows = self.right.len();
        let right = self.right.clone().insert_rows(rows, count, 0.0);
        bounded(&damped, &right, room).expect("damped columns do not depend on each other")
    }

    /// The step in the parameters' own units.
    pub(crate) fn unscaled(&self, step: &DVector<f64>) -> DVector<f64> {
        step.component_div(&self.scale)
    }
}
