//! From a mirror that nobody knows to its calibration, by the procedure that `host-tool calibrate` follows on a board.

use std::pin::pin;
use std::task::{Context, Poll, Waker};

use calibration::{CorrectionError, RefineError, TabulateError, tabulate};
use calibration_procedure::{
    Bench, Calibrated, Doubt, Drift, Part, Procedure, SensorError, Source, TravelError,
};
use control_core::Calibration;
use emulated_board::{Device, Mirror};
use experiment_player::PlayError;
use experiments::Experiment;
use experiments::calibration::Effort;
use measurement::MeasurementFile;
use mirror_model::{Model, Preset, Runaway};
use virtual_mirror::ConfigError;

use crate::player::Player;
use crate::{Loop, TICK_S};

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
    /// What it reached corrects nothing.
    #[error(transparent)]
    Correct(#[from] CorrectionError),
    /// The board cannot play an experiment.
    #[error(transparent)]
    Play(#[from] PlayError),
    /// Its sensor hardly reads anything.
    #[error(transparent)]
    Sensor(#[from] SensorError),
    /// Its readings are no mirror's.
    #[error(transparent)]
    Travel(#[from] TravelError),
    /// It did not do at the end what it did at the beginning.
    #[error(transparent)]
    Drift(#[from] Drift),
    /// What came out is not to be kept.
    #[error(transparent)]
    Doubt(#[from] Doubt),
}

/// Calibrates the mirror of `config` as a board with its own sensor does that comes from the factory.
///
/// # Errors
/// Where one of the steps fails.
pub fn calibrate(config: &impl Device) -> Result<Calibrated, CalibrateError> {
    Ok(calibrate_then(config, |_| ())?.0)
}

/// Calibrates it, and goes on with the mirror as it is then, under its new calibration.
///
/// # Errors
/// Where one of the steps fails.
pub fn calibrate_then<D: Device, T>(
    config: &D,
    then: impl FnOnce(&mut Loop<'_, D::Mirror>) -> T,
) -> Result<(Calibrated, T), CalibrateError> {
    let procedure = procedure(config, Effort::USUAL)?;
    let factory = tabulate(&procedure.start)?.calibration;
    let (mut one, mut other) = (factory, factory);
    let mut bench = OnCore::new(config, &mut one, &mut other)?;
    let calibrated = at_once(procedure.run(&mut bench, Source::Mirror))?;
    bench.put_to_use(&calibrated.calibration);
    Ok((calibrated, then(bench.player.mirror())))
}

/// What is asked of a board that comes from the factory.
fn procedure(config: &impl Device, effort: Effort) -> Result<Procedure, CalibrateError> {
    // What the firmware is built with.
    let start = Model::from(Preset::Reconciled);
    let factory = tabulate(&start)?.calibration;
    Ok(Procedure {
        device: config.name().to_owned(),
        date: String::new(),
        max_v: start.parameters.drive_limit_v,
        reach_um: f64::from(factory.max_position().0),
        start,
        reads_every_tick: true,
        effort,
    })
}

/// The control core in front of a virtual mirror, as the procedure plays it.
struct OnCore<'a, M> {
    player: Player<'a, M>,
    /// Room for the calibration that is used next.
    spare: Option<&'a mut Calibration>,
    /// What was played.
    played: Vec<(Part, Experiment)>,
}

impl<'a, M: Mirror> OnCore<'a, M> {
    /// With the factory's calibration in `one`, and room for the next one.
    fn new(
        config: &impl Device<Mirror = M>,
        one: &'a mut Calibration,
        other: &'a mut Calibration,
    ) -> Result<Self, CalibrateError> {
        Ok(Self {
            player: Player::new(one, config)?,
            spare: Some(other),
            played: Vec::new(),
        })
    }

    fn put_to_use(&mut self, calibration: &Calibration) {
        if let Some(room) = self.spare.take() {
            room.clone_from(calibration);
            self.spare = Some(self.player.exchange(room));
        }
    }
}

impl<M: Mirror> Bench for OnCore<'_, M> {
    type Error = CalibrateError;

    fn tick_s(&self) -> f64 {
        TICK_S
    }

    /// It has never been driven, and its sensor's zero is known.
    async fn count_from_rest(&mut self) -> Result<(), CalibrateError> {
        Ok(())
    }

    async fn measure(
        &mut self,
        part: Part,
        experiment: &Experiment,
    ) -> Result<MeasurementFile, CalibrateError> {
        self.played.push((part, experiment.clone()));
        Ok(self.player.play(experiment)?)
    }

    async fn put_on_trial(&mut self, calibration: &Calibration) -> Result<(), CalibrateError> {
        self.put_to_use(calibration);
        Ok(())
    }

    async fn compute<T: Send + 'static>(
        &mut self,
        _what: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, CalibrateError> {
        Ok(work())
    }
}

/// What a future comes to that never waits.
fn at_once<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(done) => done,
        Poll::Pending => unreachable!("the core answers at once"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiments::calibration::RANGE;
    use virtual_mirror::MirrorConfig;

    /// `host-tool calibrate` says what it will play, and plays it by this very procedure: the core plays the same, with the
    /// same names, levels and durations, over the same range, and is calibrated by it.
    #[test]
    #[ignore = "long"]
    fn the_core_plays_what_the_procedure_says() {
        let config = MirrorConfig::paper();
        let procedure = procedure(&config, Effort::QUICK).expect("the preset has an inverse");
        let factory = tabulate(&procedure.start).expect("rising").calibration;
        let (mut one, mut other) = (factory, factory);
        let mut bench = OnCore::new(&config, &mut one, &mut other).expect("a mirror");
        let calibrated = at_once(procedure.run(&mut bench, Source::Mirror)).expect("calibrated");
        let played = bench.played;
        let said = procedure.experiments();
        assert_eq!(played.len(), said.len());
        let first_um = f64::from(
            tabulate(&calibrated.model)
                .expect("rising")
                .calibration
                .max_position()
                .0,
        );
        for ((part, played), (said_part, said)) in played.iter().zip(&said) {
            assert_eq!((part, &played.name), (said_part, &said.name));
            assert!((played.duration_s() - said.duration_s()).abs() < 1e-9);
            // The identified mirror may reach less or more far than the factory's.
            let reach_um = match part {
                Part::DriftCheck | Part::Session => {
                    assert_eq!(played, said);
                    continue;
                }
                Part::Before | Part::After => procedure.reach_um.min(first_um),
                Part::Refining => first_um,
            };
            let (_, top_um) = played.runs[0].signal.range();
            let (_, said_um) = said.runs[0].signal.range();
            let share = said_um / (RANGE * procedure.reach_um);
            assert!(
                (top_um / (RANGE * reach_um) - share).abs() < 1e-9,
                "{}",
                played.name
            );
        }
        let (before, after) = (calibrated.before.figures(), calibrated.after.figures());
        // What a usual calibration leaves, `cargo xtask bench position` counts; the tool's own check of a quick one on the
        // emulated board asks for the same.
        assert!(
            10.0 * after.rest_rms_um < before.rest_rms_um,
            "{before:?} {after:?}"
        );
    }
}
