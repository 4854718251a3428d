//! Mirrors of one family in the space whose discrepancy the other families span.

use crate::candidate::Candidate;
use crate::null_ensemble::families::CALIBRATING;
use crate::residual_space::{
    AllRows, ModelDiscrepancy, OtherFamilies, ResidualSpace, Session, Vector,
};
use crate::whereabouts::{Normal, gram};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

/// A family that was left out.
pub(crate) struct LeftOutFamily {
    space: ResidualSpace<OtherFamilies>,
    /// Residuals of its mirrors, with noise.
    residuals: Vec<Vector<OtherFamilies>>,
}

impl LeftOutFamily {
    /// Each family left out in turn. `jacobian` are the derivatives of the base's standardised predictions, `white_noise` the
    /// standard deviation of each standardised reading.
    pub(crate) fn all(
        jacobian: &DMatrix<f64>,
        discrepancy: &Arc<ModelDiscrepancy<AllRows>>,
        white_noise: &DVector<f64>,
    ) -> Vec<Self> {
        let families = CALIBRATING.len();
        // The same noise in each family's space: families differ in what their mirrors are, and in nothing else.
        let noises = parallel::map(0..discrepancy.members() / families, |seed| {
            discrepancy.whiten(&drawn(white_noise, seed as u64))
        });
        parallel::map(0..families, |family| {
            let (scored, spanning): (Vec<_>, Vec<_>) =
                (0..discrepancy.members()).partition(|member| member % families == family);
            let space = ResidualSpace::new(jacobian, discrepancy, spanning);
            let residuals = scored
                .iter()
                .zip(&noises)
                .map(|(&member, noise)| space.residual_of(member, noise))
                .collect();
            Self { space, residuals }
        })
    }

    /// The misfits of its mirrors.
    pub(crate) fn misfits(&self) -> impl Iterator<Item = f64> {
        self.residuals.iter().map(Vector::norm_squared)
    }

    /// A candidate's scores in its mirrors, 0 where it explains nothing.
    pub(crate) fn scores(&self, candidate: &Candidate) -> Vec<f64> {
        candidate.scores(&self.residuals, &self.space)
    }

    /// The normal equations of directions' amplitudes for each of its mirrors.
    pub(crate) fn normals(&self, directions: &[Vector<Session>]) -> Vec<Normal> {
        let here = directions.iter().map(|d| self.space.import(d));
        let here: Vec<Vector<OtherFamilies>> = here.collect();
        let gram = gram(&here);
        let mirrors = self.residuals.iter();
        mirrors.map(|r| Normal::onto(&gram, &here, r)).collect()
    }
}

fn drawn(white_noise: &DVector<f64>, seed: u64) -> DVector<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    white_noise.map(|deviation| {
        let normal: f64 = StandardNormal.sample(&mut rng);
        deviation * normal
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_is_scored_by_the_others() {
        // Each family has a direction of its own, so that the others explain nothing of it.
        let families = CALIBRATING.len();
        let rows = families + 1;
        let members = DMatrix::from_fn(rows, 2 * families, |row, member| {
            if row == member % families { 10.0 } else { 0.0 }
        });
        let quiet = DVector::repeat(rows, 1.0);
        let discrepancy = Arc::new(ModelDiscrepancy::new(&members, &quiet));
        let jacobian = DMatrix::from_fn(rows, 1, |row, _| if row == families { 1.0 } else { 0.0 });
        let left_out = LeftOutFamily::all(&jacobian, &discrepancy, &DVector::zeros(rows));
        assert_eq!(left_out.len(), families);
        for family in &left_out {
            let misfits: Vec<_> = family.misfits().collect();
            assert_eq!(misfits, [100.0, 100.0]);
        }
        let session: ResidualSpace<OtherFamilies> =
            ResidualSpace::new(&jacobian, &discrepancy, (0..2 * families).collect());
        // With its own family, 1 + 2 * 1.5^2 / 10 * 100 times the noise's variance.
        let quiet = discrepancy.whiten(&DVector::zeros(rows));
        let known = session.residual_of(0, &quiet).norm_squared();
        assert!((known - 100.0 / 46.0).abs() < 1e-9, "{known}");
    }
}
