//! What lumped equations leave of mirrors with nothing hidden: the model's approximation, measured.

use crate::base::{identifiable, seeds, with_own_resistances};
use crate::family;
use crate::fit::{Knob, in_units_of_trust, jacobian, predict, trust};
use crate::likeness::Likeness;
use crate::plan::{Channel, Plan};
use mirror_model::{Model, Preset, Runaway, simulate};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Mirrors of the ensemble; a multiple of the number of families.
pub const MIRRORS: usize = 240;
/// Quasi-Newton steps from one virtual mirror's fit to another's.
const STEPS: usize = 20;
/// Steps between two computations of the Jacobian.
const REFRESHED: usize = 5;
/// One mirror in so many is fitted anew from all starts.
const STUCK: usize = 8;
/// Changes with whatever changes the residuals, so that an old cache is not taken for a new one.
const VERSION: u64 = 17;

/// Residuals of the base fitted to virtual mirrors, in units of trust; one mirror a column, the families in turn.
#[derive(Clone, Debug)]
pub struct Ensemble(pub DMatrix<f64>);

impl Ensemble {
    /// The ensemble for a session, from the cache if it is there.
    ///
    /// A cache that cannot be read is made anew; one that cannot be written is done without.
    ///
    /// # Errors
    /// If the base cannot be fitted to a virtual mirror.
    pub fn new(plan: &Plan, cache: Option<&Path>) -> Result<Self, Runaway> {
        let rows = plan.observations.len();
        let likeness = Likeness::of(plan);
        let driven = &likeness.driven(plan);
        let file = cache.map(|folder| folder.join(format!("ensemble-{:016x}.f32", key(driven))));
        let cached = file.as_ref().and_then(|file| read(file, rows));
        let columns = match cached {
            Some(columns) => columns,
            None => residuals(driven)?,
        };
        if let Some(file) = file.filter(|file| !file.exists()) {
            write(&file, &columns);
        }
        let mut mirrors = DMatrix::from_vec(rows, MIRRORS, columns);
        let mut rng = ChaCha8Rng::seed_from_u64(MIRRORS as u64);
        for mut mirror in mirrors.column_iter_mut() {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let zero_um = zero_noise_um(plan) * normal;
            let offsets = plan.observations.iter().map(|o| match o.channel {
                Channel::Displacement => zero_um,
                Channel::Current(_) => 0.0,
            });
            let left = mirror.iter().zip(offsets);
            let read = left.map(|(left, offset)| likeness.amperes * left - offset);
            let trusted = in_units_of_trust(read, plan);
            mirror.copy_from(&trusted);
        }
        Ok(Self(mirrors))
    }
}

/// All displacements count from the first one at rest, and share its noise (um).
fn zero_noise_um(plan: &Plan) -> f64 {
    plan.zero().map_or(0.0, |zero| zero.noise)
}

/// In um and A: what a session trusts depends on what it measured, and others use the same cache.
fn residuals(plan: &Plan) -> Result<Vec<f64>, Runaway> {
    let mirrors: Vec<Vec<f64>> = (0..MIRRORS as u64)
        .into_par_iter()
        .map(|seed| family::observe(plan, seed))
        .collect();
    let knobs: Vec<_> = identifiable(plan).into_iter().map(Knob::Base).collect();
    let first = best(plan, &knobs, &mirrors[0])?;
    let slopes = jacobian(&first.model, plan, &knobs)?;
    let columns: Vec<_> = mirrors
        .par_iter()
        .map(|values| {
            let model = with_own_resistances(&first.model, &plan.with_values(values));
            let slopes = slopes.clone();
            follow(Start { model, slopes }, plan, &knobs, values).left
        })
        .collect();
    let columns = again(columns, plan, &mirrors, &knobs)?.concat();
    let trusted = plan.observations.iter().map(trust).cycle();
    // As the cache keeps them, so that the first diagnosis says what later ones say.
    Ok(columns
        .into_iter()
        .zip(trusted)
        .map(|(left, trust)| f64::from((left * trust) as f32))
        .collect())
}

/// Fits the base anew, from all starts, to the mirrors that are followed worst: some of them are stuck.
fn again(
    mut columns: Vec<Vec<f64>>,
    plan: &Plan,
    mirrors: &[Vec<f64>],
    knobs: &[Knob],
) -> Result<Vec<Vec<f64>>, Runaway> {
    let mut worst: Vec<usize> = (0..columns.len()).collect();
    worst.sort_by(|&a, &b| cost(&columns[b]).total_cmp(&cost(&columns[a])));
    worst.truncate(columns.len() / STUCK);
    let fresh: Result<Vec<_>, Runaway> = worst
        .par_iter()
        .map(|&index| Ok(best(plan, knobs, &mirrors[index])?.left))
        .collect();
    for (index, column) in worst.into_iter().zip(fresh?) {
        if cost(&column) < cost(&columns[index]) {
            columns[index] = column;
        }
    }
    Ok(columns)
}

fn cost(units_of_trust: &[f64]) -> f64 {
    units_of_trust.iter().map(|r| r * r).sum()
}

/// A model to fit from, and how its predictions change with each knob.
struct Start {
    model: Model,
    slopes: DMatrix<f64>,
}

/// A model fitted to a virtual mirror, and what it leaves, in units of trust.
struct Followed {
    model: Model,
    left: Vec<f64>,
}

/// The best of the fits to a virtual mirror from all starts.
fn best(plan: &Plan, knobs: &[Knob], values: &[f64]) -> Result<Followed, Runaway> {
    let free = identifiable(plan);
    let paper = Model::from(Preset::Paper);
    let fits: Result<Vec<_>, Runaway> = seeds(&paper, &free, &plan.with_values(values))
        .into_par_iter()
        .map(|model| {
            let slopes = jacobian(&model, plan, knobs)?;
            Ok(follow(Start { model, slopes }, plan, knobs, values))
        })
        .collect();
    let best = fits?
        .into_iter()
        .min_by(|a, b| cost(&a.left).total_cmp(&cost(&b.left)));
    Ok(best.expect("a fit has at least one start"))
}

/// Fits the base to a virtual mirror from the fit to another one: damped steps with Broyden's updates of that one's
/// Jacobian, which is computed anew only now and then. A third of the price of a fit of its own.
fn follow(start: Start, plan: &Plan, knobs: &[Knob], values: &[f64]) -> Followed {
    let scaled = |model: &Model| -> Option<DVector<f64>> {
        let predicted = predict(model, plan).ok()?;
        let left = values.iter().zip(predicted).map(|(v, p)| v - p);
        Some(in_units_of_trust(left, plan))
    };
    let Start {
        mut model,
        mut slopes,
    } = start;
    let mut left = scaled(&model).expect("the fit that it starts from has an answer");
    let mut damping = 1e-3;
    for round in 1..=STEPS {
        let normal = slopes.tr_mul(&slopes);
        let damped =
            &normal + DMatrix::from_diagonal(&normal.diagonal().map(|d| damping * d + 1e-6));
        let Some(step) = damped.cholesky().map(|c| c.solve(&slopes.tr_mul(&left))) else {
            break;
        };
        let step = step.map(|s: f64| s.clamp(-0.7, 0.7));
        let mut moved = model.clone();
        for (knob, s) in knobs.iter().zip(step.iter()) {
            knob.shift(&mut moved, *s);
        }
        let Some(next) = scaled(&moved) else { break };
        let surprise = (&left - &next) - &slopes * &step;
        slopes += surprise * step.transpose() / step.norm_squared().max(1e-18);
        let gain = 1.0 - next.norm_squared() / left.norm_squared();
        if gain > 0.0 {
            (model, left, damping) = (moved, next, damping / 5.0);
        } else {
            damping *= 10.0;
        }
        let stuck = gain < 1e-3;
        if stuck && round > REFRESHED {
            break;
        }
        if (round % REFRESHED == 0 || stuck) && round < STEPS {
            match jacobian(&model, plan, knobs) {
                Ok(fresh) => slopes = fresh,
                Err(_) => break,
            }
        }
    }
    let left = left.as_slice().to_vec();
    Followed { model, left }
}

/// Two sessions with the same key have the same ensemble: same drives and channels, read by the board or by meters.
fn key(plan: &Plan) -> u64 {
    let mut hasher = DefaultHasher::new();
    (VERSION, env!("CARGO_PKG_VERSION")).hash(&mut hasher);
    if plan.is_of_heaters() {
        "meters".hash(&mut hasher);
    }
    for interval in &plan.intervals {
        interval.duration_s.to_bits().hash(&mut hasher);
        interval.from_v.map(f64::to_bits).hash(&mut hasher);
        interval.to_v.map(f64::to_bits).hash(&mut hasher);
    }
    // Most sessions stay where they began.
    for (index, interval) in plan.intervals.iter().enumerate() {
        let around = [interval.ambient_k, interval.reference_um];
        if around != [0.0; 2] {
            (index, around.map(f64::to_bits)).hash(&mut hasher);
        }
    }
    for zero in &plan.own_zeros {
        let counted = plan.observations.iter().map(|o| zero.is_of(o));
        counted.collect::<Vec<_>>().hash(&mut hasher);
    }
    for observation in &plan.observations {
        (observation.interval, format!("{:?}", observation.channel)).hash(&mut hasher);
    }
    hasher.finish()
}

fn read(file: &PathBuf, rows: usize) -> Option<Vec<f64>> {
    let bytes = std::fs::read(file).ok()?;
    let values: Vec<f64> = bytes
        .chunks_exact(4)
        .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
        .collect();
    (values.len() == rows * MIRRORS && values.iter().all(|v| v.is_finite())).then_some(values)
}

fn write(file: &PathBuf, columns: &[f64]) {
    let bytes: Vec<u8> = columns
        .iter()
        .flat_map(|&v| (v as f32).to_le_bytes())
        .collect();
    let part = file.with_extension(format!("{}.part", std::process::id()));
    let made = file
        .parent()
        .is_some_and(|folder| std::fs::create_dir_all(folder).is_ok());
    if made && std::fs::write(&part, bytes).is_ok() {
        let _ = std::fs::rename(part, file);
    }
}

/// How far halving the simulation's step moves its displacement and current predictions, at most, in units of trust.
///
/// # Errors
/// If the model has no finite answer.
pub fn solver_error(
    model: &Model,
    plan: &Plan,
    resolution: f64,
) -> Result<f64, mirror_model::Runaway> {
    let coarse = plan.read(&simulate(model, &plan.intervals, resolution)?);
    let fine = plan.read(&simulate(model, &plan.intervals, resolution / 2.0)?);
    let off = coarse
        .iter()
        .zip(&fine)
        .zip(&plan.observations)
        .map(|((c, f), o)| (c - f).abs() / trust(o));
    Ok(off.fold(0.0, f64::max))
}
