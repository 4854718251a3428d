//! What a calibration needs of a bench.

use calibration::{CorrectionError, RefineError, TabulateError};
use control_core::Calibration;
use experiments::Experiment;
use measurement::MeasurementFile;
use mirror_model::Runaway;

use crate::doubt::Doubt;
use crate::drift::Drift;
use crate::screening::SensorError;
use crate::travel::TravelError;

/// What an experiment is played for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// To see that nothing moves from the beginning to the end.
    DriftCheck,
    /// To identify the mirror.
    Session,
    /// To try the calibration that the board had.
    Before,
    /// To refine the new one.
    Refining,
    /// To try the refined one.
    After,
}

/// A board with a mirror and a sensor.
pub trait Bench {
    /// Why it fails.
    type Error: From<Runaway>
        + From<TabulateError>
        + From<RefineError>
        + From<CorrectionError>
        + From<SensorError>
        + From<TravelError>
        + From<Drift>
        + From<Doubt>;

    /// One control tick (s).
    fn tick_s(&self) -> f64;

    /// Lets the mirror come to rest, and displacements count from there.
    fn count_from_rest(&mut self) -> impl Future<Output = Result<(), Self::Error>>;

    /// Plays an experiment under the calibration in use; all channels are off afterwards.
    fn measure(
        &mut self,
        part: Part,
        experiment: &Experiment,
    ) -> impl Future<Output = Result<MeasurementFile, Self::Error>>;

    /// Uses `calibration` from now on, on trial: the one before comes back if the procedure does not end well.
    fn put_on_trial(
        &mut self,
        calibration: &Calibration,
    ) -> impl Future<Output = Result<(), Self::Error>>;

    /// Computes something that takes long. `what` says what.
    fn compute<T: Send + 'static>(
        &mut self,
        what: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> impl Future<Output = Result<T, Self::Error>>;
}
