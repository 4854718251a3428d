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

use cache::{Key, Shape, cached};
use conditions::Conditions;
use drive_scaling::DriveScaling;
use families::CALIBRATING;
use identification::dataset::{Channel, Dataset, Observation};
use identification::prediction::{standard_deviation, standardised};
use mirror_model::{ACTUATORS, Device, Interval, Runaway};
use nalgebra::DMatrix;
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
}

impl NullEnsemble {
    /// The ensemble for a session of a mirror of which this much is known. `cache` is a folder that keeps what depends on the
    /// session's drives and on the mirror's description only; what is not whole in it is replaced, and where it cannot be
    /// written it is done without.
    ///
    /// # Errors
    /// [`Runaway`] if the base cannot be fitted to a virtual mirror.
    pub fn new(data: &Dataset, device: &Device, cache: Option<&Path>) -> Result<Self, Runaway> {
        let shape = Shape {
            rows: data.observations.len(),
            members: MEMBERS,
        };
        let scaling = DriveScaling::of(data);
        let conditions = Conditions::of(data, device, &scaling);
        let key = conditions.key(&PROGRAM);
        let values = cached(cache, &key, shape, || {
            residuals(conditions.data(), conditions.device(), shape.members)
        })?;
        let values = values.into_iter().map(f64::from).collect();
        let unread = DMatrix::from_vec(shape.rows, shape.members, values);
        Ok(Self {
            residuals: as_read(unread, data, scaling),
        })
    }

    /// Standardised as the session is, one mirror a column.
    pub fn residuals(&self) -> &DMatrix<f64> {
        &self.residuals
    }
}

/// What the base leaves of virtual mirrors (um, A), one after the other. A pure function of the conditions.
fn residuals(conditions: &Dataset, device: &Device, members: usize) -> Result<Vec<f32>, Runaway> {
    let mirrors: Vec<Vec<f64>> = (0..members as u64)
        .into_par_iter()
        .map(|seed| families::observe(conditions, device, seed))
        .collect();
    // What a fit trusts a current to depends on its size: on the mean mirror's.
    let weighed = conditions.with_values(&mean(&mirrors));
    let columns = fitting::residuals(&weighed, &mirrors)?;
    let deviations: Vec<f64> = weighed
        .observations
        .iter()
        .map(standard_deviation)
        .collect();
    Ok(columns
        .iter()
        .flat_map(|left| left.iter().zip(&deviations))
        .map(|(left, deviation)| (left * deviation) as f32)
        .collect())
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
    for value in residuals(&probe(), &Device::default(), CALIBRATING.len()).unwrap_or_default() {
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
