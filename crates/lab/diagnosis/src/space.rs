//! Residuals as a space with an inner product in which the base's parameters and the model's approximation are free.
//!
//! A residual is written as `r = J d + U a + noise`: `J` moves with the base's parameters (any amount), `U` are the
//! residuals of virtual mirrors (each with weight of order one), the noise is white. What is left of two residuals after
//! the best `d` and `a` is their product `<r, s>`; `<r, r>` is the misfit, and a direction `g` explains
//! `<g, r>^2/<g, g>` of it. This is whitening with the covariance of the approximation, without forming it.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use std::sync::Arc;

/// How much further than the virtual mirrors a real one may lie in the directions in which they differ.
const WIDENING: f64 = 1.5;
/// No mirror spans further than this many times what the middle one of them does: a single one that the base fits badly would
/// make whatever it shows cheap.
const FURTHEST: f64 = 2.0;
/// Columns of a product that one thread computes at a time.
const BLOCK: usize = 32;

/// The model's approximation and the noise: what all spaces of a session share. All numbers come in units of trust.
#[derive(Debug)]
pub struct Approximation {
    /// 1 / standard deviation of what is neither base nor approximation.
    inverse_noise: DVector<f64>,
    /// Residuals of the virtual mirrors over the noise, one mirror a column.
    mirrors: DMatrix<f64>,
    /// Their products with each other.
    gram: DMatrix<f64>,
    /// How far each spans the approximation, 1 or less.
    reach: Vec<f64>,
}

impl Approximation {
    /// From the residuals of virtual mirrors, one a column, and the noise of each row.
    pub fn new(mirrors: &DMatrix<f64>, noise: &DVector<f64>) -> Self {
        let inverse_noise = noise.map(|sigma| 1.0 / sigma);
        let mirrors = weighed(mirrors, &inverse_noise);
        let starts: Vec<usize> = (0..mirrors.ncols()).step_by(BLOCK).collect();
        let blocks: Vec<_> = starts
            .into_par_iter()
            .map(|start| {
                let count = BLOCK.min(mirrors.ncols() - start);
                mirrors.tr_mul(&mirrors.columns(start, count)).data.into()
            })
            .collect::<Vec<Vec<f64>>>();
        let gram = DMatrix::from_vec(mirrors.ncols(), mirrors.ncols(), blocks.concat());
        Self {
            reach: reach(&gram),
            inverse_noise,
            mirrors,
            gram,
        }
    }

    /// How many mirrors there are.
    pub fn mirrors(&self) -> usize {
        self.mirrors.ncols()
    }

    /// What one mirror showed, to be seen in a space.
    pub fn mirror(&self, index: usize) -> Vector {
        Vector {
            scaled: self.mirrors.column(index).into_owned(),
            along_mirrors: self.gram.column(index).into_owned(),
            onto: DVector::zeros(0),
        }
    }

    /// A vector, to be seen in a space.
    pub fn vector(&self, units_of_trust: &DVector<f64>) -> Vector {
        let scaled = units_of_trust.component_mul(&self.inverse_noise);
        Vector {
            along_mirrors: self.mirrors.tr_mul(&scaled),
            scaled,
            onto: DVector::zeros(0),
        }
    }
}

fn reach(gram: &DMatrix<f64>) -> Vec<f64> {
    let sizes: Vec<f64> = gram.diagonal().iter().map(|square| square.sqrt()).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let most = |size: f64| (FURTHEST * middle / size).min(1.0);
    sizes.into_iter().map(most).collect()
}

fn weighed(columns: &DMatrix<f64>, inverse_noise: &DVector<f64>) -> DMatrix<f64> {
    let mut columns = columns.clone();
    for mut column in columns.column_iter_mut() {
        column.component_mul_assign(inverse_noise);
    }
    columns
}

/// A vector with what inner products need of it.
#[derive(Clone, Debug)]
pub struct Vector {
    /// Over the noise.
    scaled: DVector<f64>,
    /// Its products with all the mirrors.
    along_mirrors: DVector<f64>,
    /// What base and approximation can do of it, in one space.
    onto: DVector<f64>,
}

/// The space of a session's residuals. All vectors come in units of trust.
#[derive(Debug)]
pub struct Space {
    approximation: Arc<Approximation>,
    /// The mirrors that span the approximation here, each with its weight.
    members: Vec<(usize, f64)>,
    base: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl Space {
    /// The space with these base directions, its approximation spanned by some of the mirrors.
    pub fn new(
        jacobian: &DMatrix<f64>,
        approximation: &Arc<Approximation>,
        members: Vec<usize>,
    ) -> Self {
        let base = weighed(jacobian, &approximation.inverse_noise);
        let (free, all) = (base.ncols(), base.ncols() + members.len());
        let share = WIDENING / (members.len() as f64).sqrt();
        let members: Vec<(usize, f64)> = members
            .into_iter()
            .map(|member| (member, share * approximation.reach[member]))
            .collect();
        let own = base.tr_mul(&base);
        let across = base.tr_mul(&approximation.mirrors);
        let mut normal = DMatrix::from_fn(all, all, |row, column| {
            match (row.checked_sub(free), column.checked_sub(free)) {
                (None, None) => own[(row, column)],
                (None, Some(mirror)) => {
                    let (mirror, weight) = members[mirror];
                    weight * across[(row, mirror)]
                }
                (Some(mirror), None) => {
                    let (mirror, weight) = members[mirror];
                    weight * across[(column, mirror)]
                }
                (Some(one), Some(other)) => {
                    let ((one, here), (other, there)) = (members[one], members[other]);
                    here * there * approximation.gram[(one, other)]
                }
            }
        });
        for index in 0..all {
            normal[(index, index)] += if index < free {
                1e-9 * normal[(index, index)] + 1e-12
            } else {
                1.0
            };
        }
        Self {
            approximation: approximation.clone(),
            members,
            base,
            normal: normal
                .cholesky()
                .expect("a Gram matrix with a prior is positive definite"),
        }
    }

    /// A space in which only the base is free, and every row is trusted alike.
    pub fn of_base(jacobian: &DMatrix<f64>) -> Self {
        let rows = jacobian.nrows();
        let nothing = Approximation::new(&DMatrix::zeros(rows, 0), &DVector::repeat(rows, 1.0));
        Self::new(jacobian, &Arc::new(nothing), Vec::new())
    }

    /// The same space around another fit, where the base has these directions.
    pub fn around(&self, jacobian: &DMatrix<f64>) -> Self {
        let members = self.members.iter().map(|&(member, _)| member).collect();
        Self::new(jacobian, &self.approximation, members)
    }

    /// A vector of this space.
    pub fn vector(&self, units_of_trust: &DVector<f64>) -> Vector {
        self.of(self.approximation.vector(units_of_trust))
    }

    /// A vector of the approximation, or of another space with the same one, seen in this space.
    pub fn of(&self, vector: Vector) -> Vector {
        let onto = self
            .normal
            .l_dirty()
            .solve_lower_triangular(&self.along(&vector))
            .expect("a Cholesky factor is regular");
        Vector { onto, ..vector }
    }

    /// `<a, b>`.
    pub fn product(&self, a: &Vector, b: &Vector) -> f64 {
        a.scaled.dot(&b.scaled) - a.onto.dot(&b.onto)
    }

    /// A vector in units of trust again.
    pub fn unscaled(&self, vector: &Vector) -> DVector<f64> {
        vector
            .scaled
            .component_div(&self.approximation.inverse_noise)
    }

    /// What of a vector neither base nor approximation explains, in units of trust.
    pub fn remainder(&self, vector: &Vector) -> DVector<f64> {
        let weights = self.normal.solve(&self.along(vector));
        let free = self.base.ncols();
        let mut of_mirrors = DVector::zeros(self.approximation.mirrors());
        for (mirror, &(member, weight)) in self.members.iter().enumerate() {
            of_mirrors[member] = weight * weights[free + mirror];
        }
        let explained =
            &self.base * weights.rows(0, free) + &self.approximation.mirrors * of_mirrors;
        (&vector.scaled - explained).component_div(&self.approximation.inverse_noise)
    }

    /// Products with what the space leaves free and with its own mirrors.
    fn along(&self, vector: &Vector) -> DVector<f64> {
        let of_base = self.base.tr_mul(&vector.scaled);
        let of_mirrors = self
            .members
            .iter()
            .map(|&(member, weight)| weight * vector.along_mirrors[member]);
        DVector::from_iterator(
            of_base.len() + self.members.len(),
            of_base.iter().copied().chain(of_mirrors),
        )
    }
}

impl std::ops::Add for &Vector {
    type Output = Vector;
    fn add(self, other: Self) -> Vector {
        self - &(other * -1.0)
    }
}

impl std::ops::Sub for &Vector {
    type Output = Vector;
    fn sub(self, other: Self) -> Vector {
        Vector {
            scaled: &self.scaled - &other.scaled,
            along_mirrors: &self.along_mirrors - &other.along_mirrors,
            onto: &self.onto - &other.onto,
        }
    }
}

impl std::ops::Mul<f64> for &Vector {
    type Output = Vector;
    fn mul(self, factor: f64) -> Vector {
        Vector {
            scaled: &self.scaled * factor,
            along_mirrors: &self.along_mirrors * factor,
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
        let approximation = Approximation::new(&spanning, &DVector::repeat(40, 0.5));
        Space::new(&jacobian, &Arc::new(approximation), vec![0, 1, 2])
    }

    #[test]
    fn what_the_base_can_do_is_free() {
        let space = space();
        let line = space.vector(&DVector::from_fn(40, |r, _| 3.0 - 0.2 * r as f64));
        assert!(space.product(&line, &line).abs() < 1e-4);
    }

    #[test]
    fn one_mirror_that_is_fitted_badly_makes_nothing_cheap() {
        let sine = |r: usize, c: usize| ((c + 1) as f64 * r as f64 * 0.1).sin();
        let jacobian = DMatrix::from_element(40, 1, 1.0);
        let misfit = |last: f64| {
            let spanning =
                DMatrix::from_fn(40, 3, |r, c| if c == 2 { last } else { 5.0 } * sine(r, c));
            let approximation = Approximation::new(&spanning, &DVector::repeat(40, 0.5));
            let space = Space::new(&jacobian, &Arc::new(approximation), vec![0, 1, 2]);
            let like_the_last = space.vector(&DVector::from_fn(40, |r, _| 20.0 * sine(r, 2)));
            space.product(&like_the_last, &like_the_last)
        };
        assert!(misfit(5000.0) > 0.2 * misfit(5.0));
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
