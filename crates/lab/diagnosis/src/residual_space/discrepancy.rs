//! The model's discrepancy as a covariance of low rank: what lumped equations leave of mirrors that lack nothing.

use super::expectation::Expectation;
use super::reach::reach;
use nalgebra::{DMatrix, DVector};
use std::marker::PhantomData;
use std::ops::{Add, Mul, Sub};

/// Columns of a product that one thread computes at a time: a block of 32 x 8000 doubles stays in a 2 MB cache.
const BLOCK: usize = 32;

/// The covariance of what is neither base nor effect: white noise, and the span of the null ensemble's residuals. `R` says
/// which rows it weighs.
#[derive(Debug)]
pub struct ModelDiscrepancy<R> {
    /// 1 / standard deviation of the white noise of each row's standardised residual.
    inverse_noise: DVector<f64>,
    /// Standardised residuals of the ensemble over the noise, one member a column.
    members: DMatrix<f64>,
    /// The members' Euclidean products with each other.
    gram: DMatrix<f64>,
    /// The coordinates of the base's parameters as fitted to each member, one member a column. Without rows where nothing is
    /// expected from them.
    coordinates: DMatrix<f64>,
    /// What the forms of the effects that the model has may be off by, over the noise, each by one standard deviation.
    forms: DMatrix<f64>,
    rows: PhantomData<fn() -> R>,
}

/// A residual over the noise, with its products with the ensemble: what all spaces with one covariance share.
#[derive(Clone, Debug)]
pub struct Whitened<R> {
    pub(super) over_noise: DVector<f64>,
    pub(super) onto_members: DVector<f64>,
    rows: PhantomData<fn() -> R>,
}

impl<R> ModelDiscrepancy<R> {
    /// From the standardised residuals of the ensemble, one member a column, and the standard deviation of the white noise of
    /// each row's standardised residual. It is zero on average.
    pub fn new(residuals: &DMatrix<f64>, white_noise: &DVector<f64>) -> Self {
        Self::given(
            &DMatrix::zeros(0, residuals.ncols()),
            residuals,
            white_noise,
        )
    }

    /// The same conditional on the base's fitted parameters, whose coordinates are these of the members, one a column.
    pub fn given(
        coordinates: &DMatrix<f64>,
        residuals: &DMatrix<f64>,
        white_noise: &DVector<f64>,
    ) -> Self {
        let inverse_noise = white_noise.map(|deviation| 1.0 / deviation);
        let members = scaled(residuals, &inverse_noise);
        Self {
            inverse_noise,
            gram: gram(&members),
            forms: DMatrix::zeros(members.nrows(), 0),
            members,
            coordinates: coordinates.clone(),
            rows: PhantomData,
        }
    }

    /// The same where the forms of the model's effects may be off as well: standardised, each column by one standard deviation.
    pub fn with_forms(self, standardised: &DMatrix<f64>) -> Self {
        Self {
            forms: self.over_noise(standardised),
            ..self
        }
    }

    pub(super) fn forms(&self) -> &DMatrix<f64> {
        &self.forms
    }

    /// How many members the ensemble has.
    pub fn members(&self) -> usize {
        self.members.ncols()
    }

    /// The sum of the members' residuals with these coefficients.
    pub fn combined(&self, coefficients: &DVector<f64>) -> Whitened<R> {
        Whitened {
            over_noise: &self.members * coefficients,
            onto_members: &self.gram * coefficients,
            rows: PhantomData,
        }
    }

    /// The coordinates of the base's parameters as fitted to one member.
    pub fn coordinates_of(&self, member: usize) -> &[f64] {
        let count = self.coordinates.nrows();
        &self.coordinates.as_slice()[member * count..][..count]
    }

    /// What some of the members span, the standard deviation of each one's coefficient being `scale`.
    pub(super) fn spanned_by(&self, members: &[usize], scale: f64) -> Spanned {
        let expectation = Expectation::new(&self.coordinates, &self.gram, members);
        let mut span = expectation.unexpected();
        let mut gram = span.tr_mul(&(&self.gram * &span));
        for (index, reach) in reach(&gram).into_iter().enumerate() {
            let deviation = scale * reach;
            span.column_mut(index).scale_mut(deviation);
            gram.row_mut(index).scale_mut(deviation);
            gram.column_mut(index).scale_mut(deviation);
        }
        Spanned {
            expectation,
            span,
            gram,
        }
    }

    /// A standardised residual over the noise.
    pub fn whiten(&self, standardised: &DVector<f64>) -> Whitened<R> {
        let over_noise = standardised.component_mul(&self.inverse_noise);
        Whitened {
            onto_members: self.members.tr_mul(&over_noise),
            over_noise,
            rows: PhantomData,
        }
    }

    pub(super) fn over_noise(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        scaled(columns, &self.inverse_noise)
    }

    pub(super) fn times_noise(&self, over_noise: &DVector<f64>) -> DVector<f64> {
        over_noise.component_div(&self.inverse_noise)
    }

    /// The sum of the members with these coefficients, over the noise.
    pub(super) fn sum(&self, coefficients: &DVector<f64>) -> DVector<f64> {
        &self.members * coefficients
    }

    /// Products of columns over the noise with the members.
    pub(super) fn onto_members(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        columns.tr_mul(&self.members)
    }
}

/// What members span beyond what is expected of them.
#[derive(Debug)]
pub(super) struct Spanned {
    pub(super) expectation: Expectation,
    /// Sums of members, one a column, whose coefficients have a variance of 1.
    pub(super) span: DMatrix<f64>,
    /// Their Euclidean products with each other.
    pub(super) gram: DMatrix<f64>,
}

fn scaled(columns: &DMatrix<f64>, factors: &DVector<f64>) -> DMatrix<f64> {
    let mut columns = columns.clone();
    for mut column in columns.column_iter_mut() {
        column.component_mul_assign(factors);
    }
    columns
}

fn gram(members: &DMatrix<f64>) -> DMatrix<f64> {
    let starts = (0..members.ncols()).step_by(BLOCK);
    let blocks: Vec<Vec<f64>> = parallel::map(starts, |start| {
        let count = BLOCK.min(members.ncols() - start);
        members.tr_mul(&members.columns(start, count)).data.into()
    });
    DMatrix::from_vec(members.ncols(), members.ncols(), blocks.concat())
}

impl<R> Add for &Whitened<R> {
    type Output = Whitened<R>;
    fn add(self, other: Self) -> Whitened<R> {
        Whitened {
            over_noise: &self.over_noise + &other.over_noise,
            onto_members: &self.onto_members + &other.onto_members,
            rows: PhantomData,
        }
    }
}

impl<R> Sub for &Whitened<R> {
    type Output = Whitened<R>;
    fn sub(self, other: Self) -> Whitened<R> {
        Whitened {
            over_noise: &self.over_noise - &other.over_noise,
            onto_members: &self.onto_members - &other.onto_members,
            rows: PhantomData,
        }
    }
}

impl<R> Mul<f64> for &Whitened<R> {
    type Output = Whitened<R>;
    fn mul(self, factor: f64) -> Whitened<R> {
        Whitened {
            over_noise: &self.over_noise * factor,
            onto_members: &self.onto_members * factor,
            rows: PhantomData,
        }
    }
}
