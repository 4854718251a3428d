//! The space of a session's residuals: generalised least squares with a low-rank covariance of the model's discrepancy.
//!
//! A standardised residual is `r = J d + U a + e`. `J` are the derivatives of the base's predictions and `d` is free (a flat
//! prior); the columns of `U` are the residuals of the null ensemble ([`ModelDiscrepancy`]), less what follows from the base's
//! fitted parameters where these are known, and `a ~ N(0, W^2)`; `e` is white noise. Where the model has effects, what their forms may be
//! off by are more columns, `F`, whose coefficients are `N(0, 1)`. With `V = cov(e) + F F' + U W^2 U'` the inner product of the space is
//!
//! `<r, s> = r' (V^-1 - V^-1 J (J' V^-1 J)^-1 J' V^-1) s`.
//!
//! `<r, r>` is the misfit that neither base nor discrepancy explains, and a direction `g` explains `<g, r>^2 / <g, g>` of
//! it. `V` is never formed: by Woodbury's identity only the normal matrix of `[J, F, U W]` is factorised.
//!
//! Sources: M. Kennedy and A. O'Hagan, "Bayesian calibration of computer models", J. R. Stat. Soc. B 63 (2001) 425-464 (the
//! discrepancy as a random function); C. Rasmussen and C. Williams, "Gaussian Processes for Machine Learning" (2006),
//! section 2.7 (free parameters under a flat prior) and appendix A.3 (Woodbury).
//!
//! A vector belongs to its space by its type. Vectors of two spaces have no product:
//!
//! ```compile_fail
//! use diagnosis::residual_space::{BaseOnly, Session, Vector};
//! fn mixed(a: &Vector<Session>, b: &Vector<BaseOnly>) -> f64 {
//!     a.dot(b)
//! }
//! ```
//!
//! ```
//! use diagnosis::residual_space::{Session, Vector};
//! fn alike(a: &Vector<Session>, b: &Vector<Session>) -> f64 {
//!     a.dot(b)
//! }
//! ```

mod discrepancy;
mod expectation;
mod reach;

use discrepancy::Spanned;
pub use discrepancy::{ModelDiscrepancy, Whitened};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::ops::{Mul, Sub};
use std::sync::Arc;

/// Prior standard deviation of how far a session lies along the null ensemble's residuals, in units of what one of its
/// mirrors does: a user's mirror comes from none of the ensemble's families and may lie further out. Set by `cargo xtask
/// bench diagnose`.
const DISCREPANCY_SCALE: f64 = 1.5;
/// A ridge that keeps the normal matrix regular where the data do not determine a parameter of the base: a part of its
/// diagonal, far above the rounding of a double (1e-16) and far below any curvature that the data have.
const RIDGE: f64 = 1e-9;
/// The same for a parameter that no reading depends on.
const LEAST_RIDGE: f64 = 1e-12;

/// A kind of space, which its vectors carry in their type.
pub trait Kind: Clone {
    /// Which rows its covariance weighs, and how.
    type Rows: Clone;
}

/// All rows, each with its own noise.
#[derive(Clone, Copy, Debug)]
pub enum AllRows {}
/// The rows held out weigh nothing.
#[derive(Clone, Copy, Debug)]
pub enum TrainingRows {}
/// Every row alike, and no discrepancy.
#[derive(Clone, Copy, Debug)]
pub enum RowsAlike {}

/// The space of a session's scores: base and discrepancy of the whole ensemble are free.
#[derive(Clone, Copy, Debug)]
pub enum Session {}
/// The same with the discrepancy of all families of mirrors but one.
#[derive(Clone, Copy, Debug)]
pub enum OtherFamilies {}
/// The same around the fit of base and effect together.
#[derive(Clone, Copy, Debug)]
pub enum AroundRefit {}
/// The space of the rows that are not held out.
#[derive(Clone, Copy, Debug)]
pub enum Training {}
/// Ordinary least squares: only the base is free.
#[derive(Clone, Copy, Debug)]
pub enum BaseOnly {}

impl Kind for Session {
    type Rows = AllRows;
}
impl Kind for OtherFamilies {
    type Rows = AllRows;
}
impl Kind for AroundRefit {
    type Rows = AllRows;
}
impl Kind for Training {
    type Rows = TrainingRows;
}
impl Kind for BaseOnly {
    type Rows = RowsAlike;
}

/// A space of residuals. See the module.
#[derive(Debug)]
pub struct ResidualSpace<K: Kind> {
    discrepancy: Arc<ModelDiscrepancy<K::Rows>>,
    /// What some members of the ensemble span of it.
    spanned: Arc<Spanned>,
    /// Derivatives of the base's predictions over the white noise, and what the forms of the model's effects may be off by.
    base: DMatrix<f64>,
    /// The factor of `[J, F, U W]' [J, F, U W]` and the priors' precision.
    normal: Cholesky<f64, Dyn>,
}

/// A vector of the space `K`.
#[derive(Clone, Debug)]
pub struct Vector<K: Kind> {
    whitened: Whitened<K::Rows>,
    /// What base and discrepancy explain of it, in coordinates in which products are sums.
    explained: DVector<f64>,
}

impl<K: Kind> ResidualSpace<K> {
    /// The space with these derivatives of the base's standardised predictions, its discrepancy spanned by some of the
    /// ensemble's members.
    pub fn new(
        jacobian: &DMatrix<f64>,
        discrepancy: &Arc<ModelDiscrepancy<K::Rows>>,
        members: Vec<usize>,
    ) -> Self {
        let scale = DISCREPANCY_SCALE / (members.len() as f64).sqrt();
        let spanned = Arc::new(discrepancy.spanned_by(&members, scale));
        Self::spanned(jacobian, discrepancy.clone(), spanned)
    }

    fn spanned(
        jacobian: &DMatrix<f64>,
        discrepancy: Arc<ModelDiscrepancy<K::Rows>>,
        spanned: Arc<Spanned>,
    ) -> Self {
        let free = jacobian.ncols();
        let forms = discrepancy.forms();
        let mut base = discrepancy
            .over_noise(jacobian)
            .insert_columns(free, forms.ncols(), 0.0);
        base.columns_mut(free, forms.ncols()).copy_from(forms);
        let normal = normal_matrix(&base, free, &discrepancy, &spanned);
        Self {
            discrepancy,
            spanned,
            base,
            normal: normal
                .cholesky()
                .expect("a Gram matrix with a prior is positive definite"),
        }
    }

    /// The space whose discrepancy the whole ensemble spans.
    pub fn of_all(jacobian: &DMatrix<f64>, discrepancy: &Arc<ModelDiscrepancy<K::Rows>>) -> Self {
        Self::new(jacobian, discrepancy, (0..discrepancy.members()).collect())
    }

    /// A space with the same discrepancy where the base has other derivatives, as around another fit.
    pub fn around<L: Kind<Rows = K::Rows>>(&self, jacobian: &DMatrix<f64>) -> ResidualSpace<L> {
        ResidualSpace::spanned(jacobian, self.discrepancy.clone(), self.spanned.clone())
    }

    /// What a base with these coordinates leaves, less what is expected of it.
    pub fn residual(&self, standardised: &DVector<f64>, coordinates: &[f64]) -> Vector<K> {
        self.project(&self.discrepancy.whiten(standardised) - &self.expected(coordinates))
    }

    /// What one member of the ensemble shows with this noise, less what is expected of it.
    pub fn residual_of(&self, member: usize, noise: &Whitened<K::Rows>) -> Vector<K> {
        let mut own = DVector::zeros(self.discrepancy.members());
        own[member] = 1.0;
        let coordinates = self.discrepancy.coordinates_of(member);
        let unexpected = own - self.spanned.expectation.expected(coordinates);
        self.project(&self.discrepancy.combined(&unexpected) + noise)
    }

    fn expected(&self, coordinates: &[f64]) -> Whitened<K::Rows> {
        let expected = self.spanned.expectation.expected(coordinates);
        self.discrepancy.combined(&expected)
    }

    /// A standardised residual as a vector of this space.
    pub fn vector(&self, standardised: &DVector<f64>) -> Vector<K> {
        self.project(self.discrepancy.whiten(standardised))
    }

    /// A vector of this space from what all spaces with its covariance share.
    pub fn project(&self, whitened: Whitened<K::Rows>) -> Vector<K> {
        let explained = self
            .normal
            .l_dirty()
            .solve_lower_triangular(&self.onto_free(&whitened))
            .expect("a Cholesky factor is regular");
        Vector {
            explained,
            whitened,
        }
    }

    /// A vector of another space with the same covariance, in this one.
    pub fn import<L: Kind<Rows = K::Rows>>(&self, vector: &Vector<L>) -> Vector<K> {
        self.project(vector.whitened.clone())
    }

    /// The standardised residual that a vector came from.
    pub fn standardised(&self, vector: &Vector<K>) -> DVector<f64> {
        self.discrepancy.times_noise(&vector.whitened.over_noise)
    }

    /// What of a vector neither base nor discrepancy explains, as a standardised residual.
    pub fn remainder(&self, vector: &Vector<K>) -> DVector<f64> {
        let coefficients = self.normal.solve(&self.onto_free(&vector.whitened));
        let free = self.base.ncols();
        let spanning = coefficients.rows(free, coefficients.len() - free);
        let of_members = &self.spanned.span * spanning;
        let explained = &self.base * coefficients.rows(0, free) + self.discrepancy.sum(&of_members);
        self.discrepancy
            .times_noise(&(&vector.whitened.over_noise - explained))
    }

    /// Euclidean products with the columns of `[J, F, U W]`.
    fn onto_free(&self, whitened: &Whitened<K::Rows>) -> DVector<f64> {
        let onto_base = self.base.tr_mul(&whitened.over_noise);
        let onto_spanned = self.spanned.span.tr_mul(&whitened.onto_members);
        DVector::from_iterator(
            onto_base.len() + onto_spanned.len(),
            onto_base.iter().chain(onto_spanned.iter()).copied(),
        )
    }
}

impl ResidualSpace<BaseOnly> {
    /// The space of ordinary least squares around a base with these derivatives.
    pub fn of_base(jacobian: &DMatrix<f64>) -> Self {
        let rows = jacobian.nrows();
        let none = ModelDiscrepancy::new(&DMatrix::zeros(rows, 0), &DVector::repeat(rows, 1.0));
        Self::new(jacobian, &Arc::new(none), Vec::new())
    }
}

/// `[J, F, U W]' [J, F, U W]` with the precision of the priors: none of the base's parameters, the first `free` columns, beyond a ridge,
/// 1 of all other coefficients.
fn normal_matrix<R>(
    base: &DMatrix<f64>,
    free: usize,
    discrepancy: &ModelDiscrepancy<R>,
    spanned: &Spanned,
) -> DMatrix<f64> {
    let (own, spanning) = (base.ncols(), spanned.span.ncols());
    let across = discrepancy.onto_members(base) * &spanned.span;
    let mut normal = DMatrix::zeros(own + spanning, own + spanning);
    normal
        .view_mut((0, 0), (own, own))
        .copy_from(&base.tr_mul(base));
    normal
        .view_mut((0, own), (own, spanning))
        .copy_from(&across);
    normal
        .view_mut((own, 0), (spanning, own))
        .copy_from(&across.transpose());
    normal
        .view_mut((own, own), (spanning, spanning))
        .copy_from(&spanned.gram);
    for index in 0..normal.nrows() {
        normal[(index, index)] += if index < free {
            RIDGE * normal[(index, index)] + LEAST_RIDGE
        } else {
            1.0
        };
    }
    normal
}

impl<K: Kind> Vector<K> {
    /// The inner product of the space.
    pub fn dot(&self, other: &Self) -> f64 {
        self.whitened.over_noise.dot(&other.whitened.over_noise)
            - self.explained.dot(&other.explained)
    }

    /// The sum of squares over the noise, whatever explains it.
    pub fn size(&self) -> f64 {
        self.whitened.over_noise.norm_squared()
    }

    /// The misfit that neither base nor discrepancy explains.
    pub fn norm_squared(&self) -> f64 {
        self.dot(self)
    }
}

impl<K: Kind> Sub for &Vector<K> {
    type Output = Vector<K>;
    fn sub(self, other: Self) -> Vector<K> {
        Vector {
            whitened: &self.whitened - &other.whitened,
            explained: &self.explained - &other.explained,
        }
    }
}

impl<K: Kind> Mul<f64> for &Vector<K> {
    type Output = Vector<K>;
    fn mul(self, factor: f64) -> Vector<K> {
        Vector {
            whitened: &self.whitened * factor,
            explained: &self.explained * factor,
        }
    }
}

#[cfg(test)]
mod tests;
