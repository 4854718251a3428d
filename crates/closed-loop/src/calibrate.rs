//! From a mirror that nobody knows to its calibration, as `host-tool calibrate` does it on a board.

use calibration::{CorrectionError, StaticPoint, TabulateError, corrected, tabulate};
use control_core::Calibration;
use diagnosis::Plan as FitPlan;
use mirror_model::{Model, Preset, Runaway};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use virtual_mirror::{ConfigError, Experiment, MirrorConfig, Plan};
use virtual_sessions::{Instruments, measure};

use crate::Loop;

/// Highest drive (V).
const MAX_V: f64 = 3.5;
/// Positions at which the tables are corrected, and how long the mirror stays at each (s).
const POINTS: u32 = 24;
const STAY_S: f64 = 1.5;
/// How often the tables are corrected: the second time what the first one left.
const ROUNDS: u32 = 2;
/// Noise of a reading of the sensor, the mean of 10 ms (um).
const NOISE_UM: f64 = 0.005;

/// Why a mirror could not be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// It is not a mirror.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No model fits it.
    #[error(transparent)]
    Fit(#[from] Runaway),
    /// The model gives no calibration.
    #[error(transparent)]
    Tabulate(#[from] TabulateError),
    /// The measured points correct nothing.
    #[error(transparent)]
    Correct(#[from] CorrectionError),
}

/// Measures the mirror of `config`, fits a model to what was measured, tabulates its inverse, and
/// corrects the tables where the mirror went.
///
/// # Errors
/// Where one of these steps fails.
pub fn calibrate(config: &MirrorConfig) -> Result<(Calibration, Model), CalibrateError> {
    let session = measure(config, &plan(), Instruments::PositionAndCurrents)?;
    let start = Model::from(Preset::Reconciled);
    let (model, _) = diagnosis::identify(&start, &FitPlan::new(&session), &[])?;
    let mut calibration = tabulate(&model)?.calibration;
    let mut noise = ChaCha8Rng::seed_from_u64(config.seed);
    for _ in 0..ROUNDS {
        let points = visit(&mut calibration, config, &mut noise)?;
        calibration = corrected(&calibration, &points)?;
    }
    Ok((calibration, model))
}

/// The standard session, with a step that is held for half a minute.
fn plan() -> Plan {
    let mut plan = Plan::standard(MAX_V);
    plan.experiments.push(Experiment::step(30.0, 2.0, 30.0));
    plan
}

/// Goes through the range upwards, and every other position downwards.
fn visit(
    calibration: &mut Calibration,
    config: &MirrorConfig,
    noise: &mut ChaCha8Rng,
) -> Result<Vec<StaticPoint>, ConfigError> {
    let top_um = f64::from(calibration.max_position().0);
    let mut mirror = Loop::new(calibration, config)?;
    let normal = Normal::new(0.0, NOISE_UM).expect("a positive deviation");
    let up = (1..=POINTS).step_by(2);
    let down = (2..=POINTS).rev().step_by(2);
    let mut points: Vec<_> = up
        .chain(down)
        .map(|i| {
            let asked_um = 0.995 * top_um * f64::from(i) / f64::from(POINTS);
            let reached_um = mirror.hold(asked_um, STAY_S) + normal.sample(noise);
            StaticPoint {
                asked_um,
                reached_um,
            }
        })
        .collect();
    points.sort_by(|a, b| a.asked_um.total_cmp(&b.asked_um));
    Ok(points)
}
