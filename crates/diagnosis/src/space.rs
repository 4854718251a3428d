//! Residuals as a space with an inner product in which the base's parameters and the model's approximation are free.
//!
//! A residual is written as `r = J d + U a + noise`: `J` moves with the base's parameters (any amount), `U` are the
//! residuals of virtual mirrors (each with weight of order one), the noise is white. What is left of two residuals after
//! the best `d` and `a` is their product `<r, s>`; `<r, r>` is the misfit, and a direction `g` explains
//! `<g, r>^2/<g, g>` of it. This is whitening with the covariance of the approximation, without forming it.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// How much further than the virtual mirrors a real one may lie in the directions in which they differ.
const WIDENING: f64 = 1.5;

/// A vector with what the inner product needs of it.
#[derive(Clone, Debug)]
pub struct Vector {
    scaled: DVector<f64>,
    onto: DVector<f64>,
}

/// The space of a session's residuals. All vectors come in units of trust.
#[derive(Debug)]
pub struct Space {
    /// 1 / standard deviation of what is neither base nor approximation, in units of trust.
    inverse_noise: DVector<f64>,
    nuisance: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl Space {
    /// The space with these base directions, these residuals of `SPANNING` mirrors, and this remaining noise.
    pub fn new(jacobian: &DMatrix<f64>, spanning: &DMatrix<f64>, noise: &DVector<f64>) -> Self {
        let inverse_noise = noise.map(|sigma| 1.0 / sigma);
        let base = jacobian.ncols();
        let members = spanning.ncols();
        let mut nuisance = DMatrix::zeros(jacobian.nrows(), base + members);
        nuisance.columns_mut(0, base).copy_from(jacobian);
        nuisance
            .columns_mut(base, members)
            .copy_from(&(spanning * (WIDENING / (members as f64).sqrt())));
        for mut column in nuisance.column_iter_mut() {
            column.component_mul_assign(&inverse_noise);
        }
        let mut normal = nuisance.tr_mul(&nuisance);
        for index in 0..base + members {
            normal[(index, index)] += if index < base {
                1e-9 * normal[(index, index)] + 1e-12
            } else {
                1.0
            };
        }
        let normal = normal
            .cholesky()
            .expect("a Gram matrix with a prior is positive definite");
        Self {
            inverse_noise,
            nuisance,
            normal,
        }
    }

    /// A vector of this space.
    pub fn vector(&self, units_of_trust: &DVector<f64>) -> Vector {
        let scaled = units_of_trust.component_mul(&self.inverse_noise);
        let onto = self.nuisance.tr_mul(&scaled);
        let onto = self
            .normal
            .l_dirty()
            .solve_lower_triangular(&onto)
            .expect("a Cholesky factor is regular");
        Vector { scaled, onto }
    }

    /// `<a, b>`.
    pub fn product(&self, a: &Vector, b: &Vector) -> f64 {
        a.scaled.dot(&b.scaled) - a.onto.dot(&b.onto)
    }

    /// A vector in units of trust again.
    pub fn unscaled(&self, vector: &Vector) -> DVector<f64> {
        vector.scaled.component_div(&self.inverse_noise)
    }

    /// What of a residual neither base nor approximation explains, in units of trust.
    pub fn remainder(&self, units_of_trust: &DVector<f64>) -> DVector<f64> {
        let scaled = units_of_trust.component_mul(&self.inverse_noise);
        let weights = self.normal.solve(&self.nuisance.tr_mul(&scaled));
        (scaled - &self.nuisance * weights).component_div(&self.inverse_noise)
    }
}

impl std::ops::Sub for &Vector {
    type Output = Vector;
    fn sub(self, other: Self) -> Vector {
        Vector {
            scaled: &self.scaled - &other.scaled,
            onto: &self.onto - &other.onto,
        }
    }
}

impl std::ops::Mul<f64> for &Vector {
    type Output = Vector;
    fn mul(self, factor: f64) -> Vector {
        Vector {
            scaled: &self.scaled * factor,
            onto: &self.onto * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn space() -> Space {
        let jacobian = DMatrix::from_fn(40, 2, |r, c| if c == 0 { 1.0 } else { r as f64 });
        let spanning =
            DMatrix::from_fn(40, 3, |r, c| 50.0 * ((c + 1) as f64 * r as f64 * 0.1).sin());
        Space::new(&jacobian, &spanning, &DVector::repeat(40, 0.5))
    }

    #[test]
    fn what_the_base_can_do_is_free() {
        let space = space();
        let line = space.vector(&DVector::from_fn(40, |r, _| 3.0 - 0.2 * r as f64));
        assert!(space.product(&line, &line).abs() < 1e-4);
    }

    #[test]
    fn what_the_approximation_does_is_cheap_and_what_neither_does_is_dear() {
        let space = space();
        let like = space.vector(&DVector::from_fn(40, |r, _| 20.0 * (r as f64 * 0.2).sin()));
        let unlike = space.vector(&DVector::from_fn(
            40,
            |r, _| if r % 2 == 0 { 20.0 } else { -20.0 },
        ));
        assert!(space.product(&like, &like) < 10.0);
        assert!(space.product(&unlike, &unlike) > 1e4);
    }
}
