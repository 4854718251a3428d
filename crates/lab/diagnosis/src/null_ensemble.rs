//! The null ensemble: what the base, fitted, leaves of virtual mirrors that lack no effect. Its span is the model's
//! discrepancy, and its scores are the null distribution that thresholds come from.
//!
//! The mirrors run the session's own drives. What depends on the drives only is kept in a cache ([`cache`]), under a key that
//! holds everything it is computed from ([`conditions`]).

mod cache;
mod conditions;
mod description;
mod drive_scaling;
pub(crate) mod families;
mod fitting;
mod motion;
pub(crate) mod unknowns;

use crate::progress::Count;
use crate::residual_space::ModelDiscrepancy;
use cache::{Key, Shape, cached, file_of};
use conditions::Conditions;
pub(crate) use description::Misdescribed;
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
use sha2::{Digest, Sha256};
use std::path::Path;
use std::sync::LazyLock;

/// Virtual mirrors of an ensemble, the families in turn: 48 of each of five. The 95 % quantile of 240 scores is known to 1.4
/// percent points, sqrt(0.05 * 0.95 / 240).
pub const MEMBERS: usize = 240;
const _: () = assert!(MEMBERS.is_multiple_of(CALIBRATING.len()));
/// A step of what is left, in parts of the reading's noise: rounding to it adds 0.9 % of that. Machines whose sines differ in the last
/// digit have the same steps, and so the same ensemble.
const NOISE_STEP: f64 = 1.0 / 32.0;
/// Noise below this is taken for this (A, um): no meter of a bench tells a nanoampere of milliamperes.
const LEAST_NOISE: f64 = 1e-9;
/// A step of a coordinate, a logarithm: 0.0015 % of a parameter, far below what any session leaves open of one.
const COORDINATE_STEP: f64 = 1.0 / 65_536.0;

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
        let rows = Rows::of(conditions.data());
        let (key, shape) = (key(&conditions), rows.shape());
        let steps = cached(cache, &key, shape, || {
            fitted(conditions.data(), conditions.device(), &rows, MEMBERS)
        })?;
        let (readings, parameters) = (rows.readings(), rows.parameters);
        let fitted = rows.values(&steps);
        // A heater on a bench has parameters that no mirror has.
        let comparable = if data.is_of_heaters() { 0 } else { parameters };
        Ok(Self {
            residuals: as_read(fitted.rows(0, readings).into_owned(), data, scaling),
            coordinates: fitted.rows(readings, comparable).into_owned(),
        })
    }

    /// The file that the ensemble of a session is kept in, for [`cache`] to ship.
    ///
    /// # Errors
    /// [`Runaway`] as for [`Self::new`], and what the packing says.
    pub fn file(data: &Dataset) -> Result<Vec<u8>, Box<dyn std::error::Error + Send + Sync>> {
        let device = Device::default();
        let conditions = Conditions::of(data, &device, &DriveScaling::of(data));
        let rows = Rows::of(conditions.data());
        let steps = fitted(conditions.data(), &device, &rows, MEMBERS)?;
        Ok(file_of(&key(&conditions), rows.shape(), &steps)?)
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

/// The coordinates of the base's parameters in a model fitted to a session, as far as it can identify them, were it one of the virtual
/// mirrors.
pub(crate) fn coordinates(model: &Model, data: &Dataset) -> Vec<f64> {
    let model = &DriveScaling::of(data).scaled(model, data);
    let free = identifiable(data).into_iter().map(FreeParameter::Base);
    free.map(|parameter| parameter.coordinate(model)).collect()
}

fn key(conditions: &Conditions) -> Key {
    Key {
        program: *PROGRAM,
        conditions: conditions.hash(),
    }
}

/// What is kept of a mirror: what the base leaves of it (um, A), and the coordinates of its parameters, as whole steps.
struct Rows {
    /// The observations in their order here: of one channel after those of another, for from one reading of a channel to the next little
    /// changes.
    order: Vec<usize>,
    /// The step of each observation, in the order of the observations.
    steps: Vec<f64>,
    parameters: usize,
}

impl Rows {
    fn of(conditions: &Dataset) -> Self {
        let observations = &conditions.observations;
        let mut order: Vec<usize> = (0..observations.len()).collect();
        order.sort_by_key(|&row| match observations[row].channel {
            Channel::Displacement => 0,
            Channel::Current(actuator) => 1 + actuator,
        });
        Self {
            order,
            steps: observations
                .iter()
                .map(|o| NOISE_STEP * o.noise.max(LEAST_NOISE))
                .collect(),
            parameters: identifiable(conditions).len(),
        }
    }

    fn readings(&self) -> usize {
        self.order.len()
    }

    fn shape(&self) -> Shape {
        Shape {
            rows: self.readings() + self.parameters,
            members: MEMBERS,
        }
    }

    /// One mirror's residuals (um, A), in the order of the observations, and coordinates as steps.
    fn steps<'a>(
        &'a self,
        left: &'a [f64],
        coordinates: &'a [f64],
    ) -> impl Iterator<Item = i32> + 'a {
        let left = self.order.iter().map(|&row| left[row] / self.steps[row]);
        let coordinates = coordinates.iter().map(|at| at / COORDINATE_STEP);
        left.chain(coordinates).map(|steps| steps.round() as i32)
    }

    /// The numbers that steps of all mirrors stand for, one mirror a column.
    fn values(&self, steps: &[i32]) -> DMatrix<f64> {
        let shape = self.shape();
        let mut values = DMatrix::zeros(shape.rows, shape.members);
        for (mut mirror, steps) in values.column_iter_mut().zip(steps.chunks_exact(shape.rows)) {
            let (left, coordinates) = steps.split_at(self.readings());
            for (&row, &steps) in self.order.iter().zip(left) {
                mirror[row] = self.steps[row] * f64::from(steps);
            }
            for (index, &steps) in coordinates.iter().enumerate() {
                mirror[self.readings() + index] = COORDINATE_STEP * f64::from(steps);
            }
        }
        values
    }
}

/// What the base leaves of each virtual mirror and the coordinates of its parameters, one mirror after the other, as steps. A pure
/// function of the conditions.
fn fitted(
    conditions: &Dataset,
    device: &Device,
    rows: &Rows,
    members: usize,
) -> Result<Vec<i32>, Runaway> {
    let drawn = Count::of("null ensemble: mirrors drawn", members);
    let mirrors = parallel::map(0..members as u64, |seed| {
        drawn.after(families::observe(conditions, device, seed))
    });
    // The standard deviation of a current depends on its size: the mean mirror's.
    let weighed = conditions.with_values(&mean(&mirrors));
    let fits = fitting::fits(&weighed, &mirrors)?;
    let deviations: Vec<f64> = weighed
        .observations
        .iter()
        .map(standard_deviation)
        .collect();
    let mut steps = Vec::with_capacity(fits.len() * rows.shape().rows);
    for Fit { left, coordinates } in &fits {
        let left: Vec<f64> = left
            .iter()
            .zip(&deviations)
            .map(|(left, deviation)| left * deviation)
            .collect();
        steps.extend(rows.steps(&left, coordinates));
    }
    Ok(steps)
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
            scaling.times(o.channel) * left - offset
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
static PROGRAM: LazyLock<[u8; 32]> = LazyLock::new(|| {
    let (probe, mut hash) = (probe(), Sha256::new());
    let rows = Rows::of(&probe);
    for steps in fitted(&probe, &Device::default(), &rows, CALIBRATING.len()).unwrap_or_default() {
        hash.update(steps.to_le_bytes());
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
