//! From a mirror that nobody knows to its calibration, as `host-tool calibrate` does it on a board.

use calibration::{JUMP_S, RefineError, TabulateError, jumps, refined, tabulate};
use control_core::Calibration;
use experiments::{Experiment, session as standard_session};
use identification::Dataset;
use measurement::{MeasurementFile, Session};
use mirror_model::{Model, Preset, Runaway};
use virtual_mirror::{ConfigError, MirrorConfig};
use virtual_sessions::{Instruments, measure};

use crate::record::Bench;

/// Highest drive (V).
const MAX_V: f64 = 3.5;
/// Sines of positions (Hz), for what jumps do not tell: heat and friction while the mirror keeps moving. Middle and
/// amplitude as shares of the range, and a rest before (s).
const SINES_HZ: [f64; 4] = [1.0, 5.0, 20.0, 100.0];
const SINE: (f64, f64) = (0.25, 0.12);
const REST_S: f64 = 2.0;

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
    /// What it did refines nothing.
    #[error(transparent)]
    Refine(#[from] RefineError),
}

/// Measures the mirror of `config`, fits a model to what was measured, tabulates its inverse, and refines it by what
/// the mirror does under it.
///
/// # Errors
/// Where one of these steps fails.
pub fn calibrate(config: &MirrorConfig) -> Result<(Calibration, Model), CalibrateError> {
    let session = measure(config, &plan(), Instruments::PositionAndCurrents)?;
    let start = Model::from(Preset::Reconciled);
    let (model, _) = identification::identify(&start, &Dataset::new(&session), &[])?;
    let mut calibration = tabulate(&model)?.calibration;
    let session = moves(&mut calibration, config)?;
    let refined = refined(&calibration, &session)?;
    Ok((refined.calibration, model))
}

/// The standard session, with a step that is held for half a minute.
fn plan() -> Vec<Experiment> {
    let mut plan = standard_session(MAX_V);
    plan.push(Experiment::step(2.0, 30.0, 5e3).after(30.0));
    plan
}

/// Moves all over the range under a first calibration: what refines it.
fn moves(calibration: &mut Calibration, config: &MirrorConfig) -> Result<Session, ConfigError> {
    let top_um = f64::from(calibration.max_position().0);
    let positions: Vec<f64> = jumps().into_iter().map(|share| share * top_um).collect();
    let mut bench = Bench::new(calibration, config)?;
    let mut files = vec![bench.positions(&positions, JUMP_S)];
    for hz in SINES_HZ {
        bench.rest(REST_S);
        files.push(bench.sine(SINE.0 * top_um, SINE.1 * top_um, hz));
    }
    let named = |file: MeasurementFile| (format!("{}.csv", file.experiment()), file);
    Ok(Session {
        files: files.into_iter().map(named).collect(),
    })
}
