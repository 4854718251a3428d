//! The null ensemble: what the base, fitted, leaves of virtual mirrors that lack no effect. Its span is the model's
//! discrepancy, and its scores are the null distribution that thresholds come from.
//!
//! The mirrors run the session's own drives. What depends on the drives only is kept in a cache ([`cache`]), under a key that
//! holds everything it is computed from ([`conditions`]).

mod cache;
mod conditions;
mod drive_scaling;
pub(crate) mod families;
mod fitting;
pub(crate) mod unknowns;

use crate::progress::Count;
use crate::residual_space::ModelDiscrepancy;
use cache::{Key, Shape, cached};
use conditions::Conditions;
use drive_scaling::DriveScaling;
use families::CALIBRATING;
use fitting::Fit;
use identification::base::identifiable;
use identification::dataset::{Channel, Dataset, Observation};
use identification::parameter::FreeParameter;
use identification::prediction::{standard_deviation, standardised};
use mirror_model::{ACTUATORS, Device, Interval, Model, Runaway};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::sync::LazyLock;

/// Virtual mirrors of an ensemble, the families in turn: 48 of each of five. The 95 % quantile of 240 scores is known to 1.4
/// percent points, sqrt(0.05 * 0.95 / 240).
pub const MEMBERS: usize = 240;
const _: () = assert!(MEMBERS.is_multiple_of(CALIBRATING.len()));

/// The residuals of the base fitted to virtual mirrors that lack nothing.
#[derive(Clone, Debug)]
pub struct NullEnsemble {
    residuals: DMatrix<f64>,
    /// Of the base's parameters as fitted to each mirror, one mirror a column; none where the session is of a heater on a bench.
    coordinates: DMatrix<f64>,
}

impl NullEnsemble {
    /// The ensemble for a session of a mirror of which this much is known. `cache` is a folder that keeps what depends on the
    /// session's drives and on the mirror's description only; what is not whole in it is replaced, and where it cannot be
    /// written it is done without.
    ///
    /// # Errors
    /// [`Runaway`] if the base cannot be fitted to a virtual mirror.
    pub fn new(data: &Dataset, device: &Device, cache: Option<&Path>) -> Result<Self, Runaway> {
        let scaling = DriveScaling::of(data);
        let conditions = Conditions::of(data, device, &scaling);
        let readings = data.observations.len();
        let parameters = identifiable(conditions.data()).len();
        let shape = Shape {
            rows: readings + parameters,
            members: MEMBERS,
        };
        let key = conditions.key(&PROGRAM);
        let values = cached(cache, &key, shape, || {
            fitted(conditions.data(), conditions.device(), shape.members)
        })?;
        let values = values.into_iter().map(f64::from).collect();
        let fitted = DMatrix::from_vec(shape.rows, shape.members, values);
        // A heater on a bench has parameters that no mirror has.
        let comparable = if data.is_of_heaters() { 0 } else { parameters };
        Ok(Self {
            residuals: as_read(fitted.rows(0, readings).into_owned(), data, scaling),
            coordinates: fitted.rows(readings, comparable).into_owned(),
        })
    }

    /// Standardised as the session is, one mirror a column.
    pub fn residuals(&self) -> &DMatrix<f64> {
        &self.residuals
    }

    /// The discrepancy that it spans, conditional on the base's fitted parameters.
    pub fn discrepancy<R>(&self, white_noise: &DVector<f64>) -> ModelDiscrepancy<R> {
        ModelDiscrepancy::given(&self.coordinates, &self.residuals, white_noise)
    }
}

/// The coordinates of the base's parameters in a model fitted to a session, as far as it can identify them.
pub(crate) fn coordinates(model: &Model, data: &Dataset) -> Vec<f64> {
    let free = identifiable(data).into_iter().map(FreeParameter::Base);
    free.map(|parameter| parameter.coordinate(model)).collect()
}

/// What the base leaves of each virtual mirror (um, A) and the coordinates of its parameters, one mirror after the other. A pure
/// function of the conditions.
fn fitted(conditions: &Dataset, device: &Device, members: usize) -> Result<Vec<f32>, Runaway> {
    let drawn = Count::of("null ensemble: mirrors drawn", members);
    let mirrors: Vec<Vec<f64>> = (0..members as u64)
        .into_par_iter()
        .map(|seed| drawn.after(families::observe(conditions, device, seed)))
        .collect();
    // The standard deviation of a current depends on its size: the mean mirror's.
    let weighed = conditions.with_values(&mean(&mirrors));
    let fits = fitting::fits(&weighed, &mirrors)?;
    let deviations: Vec<f64> = weighed
        .observations
        .iter()
        .map(standard_deviation)
        .collect();
    let numbers = fits.iter().flat_map(|Fit { left, coordinates }| {
        let left = left
            .iter()
            .zip(&deviations)
            .map(|(left, deviation)| left * deviation);
        left.chain(coordinates.iter().copied())
    });
    Ok(numbers.map(|number| number as f32).collect())
}

fn mean(mirrors: &[Vec<f64>]) -> Vec<f64> {
    let mut sum = vec![0.0; mirrors[0].len()];
    for mirror in mirrors {
        sum.iter_mut().zip(mirror).for_each(|(sum, v)| *sum += v);
    }
    sum.iter().map(|sum| sum / mirrors.len() as f64).collect()
}

/// Residuals (um, A) as the session's instruments would read them, standardised as the session is.
fn as_read(mut residuals: DMatrix<f64>, data: &Dataset, scaling: DriveScaling) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(MEMBERS as u64);
    for mut mirror in residuals.column_iter_mut() {
        let normal: f64 = StandardNormal.sample(&mut rng);
        let zero_um = zero_noise_um(data) * normal;
        let read = mirror.iter().zip(&data.observations).map(|(left, o)| {
            let offset = match o.channel {
                Channel::Displacement => zero_um,
                Channel::Current(_) => 0.0,
            };
            scaling.amperes * left - offset
        });
        let standardised = standardised(read, data);
        mirror.copy_from(&standardised);
    }
    residuals
}

/// All displacements count from the first one at rest, and share its noise (um).
fn zero_noise_um(data: &Dataset) -> f64 {
    data.zero().map_or(0.0, |zero| zero.noise)
}

/// What this program makes of one virtual mirror of each family in a short session: where virtual mirror, model or fit
/// change, this does, and an old cache is not taken for a new one.
static PROGRAM: LazyLock<Key> = LazyLock::new(|| {
    let mut hash = Sha256::new();
    for value in fitted(&probe(), &Device::default(), CALIBRATING.len()).unwrap_or_default() {
        hash.update(value.to_le_bytes());
    }
    hash.finalize().into()
});

/// A sweep, and steps sampled fast enough to tell time constants, with one current and the displacement.
fn probe() -> Dataset {
    let sweep = (0..5).map(|level| Interval::held([f64::from(level); ACTUATORS], 0.5));
    let step =
        (0..30).map(|sample| Interval::held([2.0, 2.0, 2.0, 0.0], 1e-3 * f64::from(1 + sample)));
    let intervals: Vec<_> = sweep.chain(step).collect();
    let observation = |interval, channel, noise| Observation {
        interval,
        channel,
        value: 0.0,
        noise,
        experiment: 0,
        t_s: 0.0,
    };
    Dataset {
        observations: (0..intervals.len())
            .flat_map(|interval| {
                [
                    observation(interval, Channel::Displacement, 0.03),
                    observation(interval, Channel::Current(0), 2e-6),
                ]
            })
            .collect(),
        intervals,
        ..Dataset::default()
    }
}

#[cfg(test)]
mod tests;
