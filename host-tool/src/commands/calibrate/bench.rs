//! The board and its sensor, as the calibration's procedure plays them.

use std::path::{Path, PathBuf};

use calibration_procedure::{Bench as Procedures, Part};
use control_core::Calibration;
use experiments::Experiment;
use measurement::MeasurementFile;
use mirror_protocol::CalibrationUse;

use crate::board::Board;
use crate::commands::measure::possible::make_directory;
use crate::commands::measure::readings::{Impossible, LONGEST_UM};
use crate::commands::measure::run::{Bench, Ended};
use crate::error::{OutputError, SensorFault, ToolError};
use crate::new_file::NewFile;

/// A board that is being calibrated.
pub(super) struct OnTrial<'a> {
    pub(super) bench: Bench<'a>,
    pub(super) board: &'a Board,
    /// Where the files of the session are kept.
    pub(super) keep: Option<&'a Path>,
    /// Whether files there are replaced.
    pub(super) force: bool,
    /// Numbers of the sensor that are no readings.
    pub(super) impossible: Impossible,
}

impl OnTrial<'_> {
    /// The file in which a measurement is kept, found out to be writable before anything moves.
    fn kept(&self, part: Part, experiment: &Experiment) -> Result<Option<NewFile>, OutputError> {
        let Some(folder) = self.keep.filter(|_| part == Part::Session) else {
            return Ok(None);
        };
        make_directory(folder)?;
        NewFile::create(kept_as(folder, experiment), self.force).map(Some)
    }
}

/// The file in a folder that an experiment of the session is kept in.
pub(super) fn kept_as(folder: &Path, experiment: &Experiment) -> PathBuf {
    folder.join(format!("{}.csv", experiment.name))
}

impl Procedures for OnTrial<'_> {
    type Error = ToolError;

    fn tick_s(&self) -> f64 {
        1.0 / f64::from(self.bench.tick_hz())
    }

    async fn count_from_rest(&mut self) -> Result<(), ToolError> {
        self.bench.count_from_rest().await
    }

    async fn measure(
        &mut self,
        part: Part,
        experiment: &Experiment,
    ) -> Result<MeasurementFile, ToolError> {
        let kept = self.kept(part, experiment)?;
        let shown = match part {
            Part::DriftCheck | Part::Session | Part::Refining => experiment.name.clone(),
            Part::Before => format!("{}, before", experiment.name),
            Part::After => format!("{}, after", experiment.name),
        };
        let measured = self.bench.measure(&experiment.clone().named(&shown)).await;
        self.impossible = self.impossible.and(measured.impossible);
        if let Some(kept) = kept {
            kept.write(&measured.file.to_string())?;
        }
        match measured.ended? {
            Ended::Interrupted => Err(ToolError::Interrupted),
            Ended::Complete => Ok(measured.file),
        }
    }

    async fn put_on_trial(&mut self, calibration: &Calibration) -> Result<(), ToolError> {
        self.board
            .use_calibration(calibration, CalibrationUse::OnTrial)
            .await?;
        self.bench
            .say("a new calibration is on trial; Ctrl-C brings back the one before");
        Ok(())
    }

    async fn compute<T: Send + 'static>(
        &mut self,
        what: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ToolError> {
        self.bench.aside(what, work).await
    }
}

/// Why a calibration fails that fails by what the sensor read. Where numbers of another unit are missing, the rest tells neither which way it
/// counts nor how far.
pub(super) fn by_unit(impossible: Impossible, error: ToolError) -> ToolError {
    let is_of_sensor = matches!(
        error,
        ToolError::SensorTravel(_)
            | ToolError::SensorReadings(_)
            | ToolError::Drift(_)
            | ToolError::Tabulate(_)
            | ToolError::Runaway(_)
            | ToolError::Refine(_)
            | ToolError::Doubt(_)
    );
    match is_of_sensor && impossible.is_of_another_unit() {
        false => error,
        true => SensorFault::OtherUnit {
            numbers: impossible.numbers,
            largest_um: impossible.largest_um,
            longest_um: LONGEST_UM,
        }
        .into(),
    }
}

#[cfg(test)]
mod tests {
    use calibration::TabulateError;
    use calibration_procedure::TravelError;

    use super::*;

    #[test]
    fn a_sensor_of_another_unit_is_not_judged_by_what_is_left_of_it() {
        let said = |impossible, error: ToolError| by_unit(impossible, error).to_string();
        let reversed = || ToolError::from(TravelError::Reversed(727.0));
        let nm = Impossible::among(&[(0.0, 12_000.0), (1.0, 164_000.0)]);
        let told = said(nm, reversed());
        assert!(
            told.contains("another unit than micrometres: 2 of its numbers")
                && told.contains("up to 164000,"),
            "{told}"
        );
        assert_eq!(
            said(Impossible::NONE, reversed()),
            reversed().to_string(),
            "it counts the other way round"
        );
        let falls = TabulateError::NotRising {
            from_v: 0.479,
            to_v: 0.492,
        };
        assert!(said(nm, falls.into()).contains("another unit"));
        let other = || ToolError::Interrupted;
        assert_eq!(said(nm, other()), other().to_string());
    }
}
