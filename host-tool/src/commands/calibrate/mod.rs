//! `calibrate`: measures and identifies the mirror, makes the board's calibration from it, refines it by what the mirror
//! does under it, and tries it at other positions than those it was made from. The steps are those of the crate
//! `calibration-procedure`.

mod bench;
mod report;
mod room_unknown;

use std::path::{Path, PathBuf};

use calibration::{tabulate, to_toml};
use calibration_procedure::{Calibrated, Part, Procedure, Source};
use charts::sheet;
use control_core::calibration::{Label, Plate};
use control_core::{CHANNELS, Calibration, Micrometre, PlateInverse};
use experiments::calibration::Effort;
use experiments::{Experiment, session_in_common};
use measurement::Session;
use mirror_model::{Model, Symbol};
use mirror_protocol::CalibrationUse;

use self::bench::{OnTrial, by_unit, kept_as};
use self::report::{CalibrateReport, Written};
use self::room_unknown::RoomUnknown;
use crate::board::Board;
use crate::cli::Calibrate;
use crate::commands::interrupt::Interrupt;
use crate::commands::kept_files::KeptFiles;
use crate::commands::lab::{model, warn};
use crate::commands::measure::header::today;
use crate::commands::measure::possible::make_directory;
use crate::commands::measure::readings::Impossible;
use crate::commands::measure::run::Bench;
use crate::commands::measure::sensor::Sensor;
use crate::commands::range_end::RangeEnd;
use crate::commands::{calibrate_sense, same_mirror, status};
use crate::error::{OutputError, SensorFault, ToolError};
use crate::new_file::{NewFile, apart};
use crate::report::{decimal, print};
use crate::tried::{Tried, before_and_after};
use crate::verbosity::note;

/// Calibrates `board`; who interrupts it is told whether anything is kept.
pub(super) async fn run(board: &Board, ask: Calibrate, json: bool) -> Result<(), ToolError> {
    let keeps = ask.keep.is_some();
    let next = match ask.from {
        Some(_) => "",
        None => "; `--keep FOLDER` keeps what is measured",
    };
    match calibrate(board, ask, json).await {
        Err(ToolError::Interrupted) if !keeps => Err(ToolError::InterruptedUnkept { next }),
        ended => ended,
    }
}

/// Until the new calibration has been tried to the end it is on trial: whatever goes wrong before, the
/// board has the one of before again, and its channels are off.
async fn calibrate(board: &Board, ask: Calibrate, json: bool) -> Result<(), ToolError> {
    let outputs = Outputs::create(&ask)?;
    let sensor = Sensor::open_live(&ask.displacements.sensor)?;
    let (device, start) = (device(board, ask.device.clone())?, start(&ask)?);
    let had = board.calibration().await?;
    let procedure = procedure(board, &ask, &sensor, (device, start)).await?;
    let source = match &ask.from {
        Some(folder) => {
            let session = Session::load(&[folder])?;
            warn(&session.flaws());
            Source::Files(session)
        }
        None => Source::Mirror,
    };
    let bench = match bench(board, &ask, sensor, &procedure.start, json).await {
        Err(error) if ask.cold_resistance.is_some() => return Err(fall_back(board, error).await),
        bench => bench?,
    };
    if let Source::Files(session) = &source
        && let Err(error) = Interrupt::listen()?
            .or(same_mirror::check_session(board, session))
            .await
    {
        return Err(fall_back(board, error).await);
    }
    let mut on_trial = OnTrial {
        bench,
        board,
        keep: ask.keep.as_deref(),
        force: ask.force,
        impossible: Impossible::NONE,
    };
    let played = played(&procedure, &source);
    on_trial.bench.say(&time_words(&played));
    if let Source::Files(session) = &source
        && let Some(lacks) = lacks(session, procedure.max_v)
    {
        note(lacks);
    }
    let experiments: Vec<Experiment> = played.into_iter().map(|(_, played)| played).collect();
    on_trial.bench.plan(&experiments);
    let kept = match procedure.run(&mut on_trial, source).await {
        Ok(calibrated) => {
            let for_good = CalibrationUse::ForGood;
            let kept = board.use_calibration(&calibrated.calibration, for_good);
            kept.await.map(|_| calibrated)
        }
        Err(error) => Err(by_unit(on_trial.impossible, error)),
    };
    on_trial.bench.close();
    match kept {
        Ok(calibrated) => {
            let board = board.identity().board.as_str().to_owned();
            let had_words = (board, status::calibrated_words(&had));
            let (written, ended) = outputs.write(&calibrated, had_words);
            let range = RangeEnd::new(procedure.reach_um, &calibrated.calibration);
            print(&report(calibrated, &had, range, written), json);
            Ok(ended?)
        }
        Err(error) => Err(fall_back(board, error).await),
    }
}

/// The files that were asked for, found out to be writable before anything moves.
struct Outputs {
    calibration: Option<NewFile>,
    model: Option<NewFile>,
    picture: Option<NewFile>,
    trial: Option<NewFile>,
}

impl Outputs {
    fn create(ask: &Calibrate) -> Result<Self, ToolError> {
        apart(&[&ask.output, &ask.model_output, &ask.picture, &ask.trial])?;
        let create = |path: PathBuf| NewFile::create(path, ask.force);
        if let Some(folder) = &ask.keep {
            make_directory(folder)?;
            // Their names are the same at any drive.
            for experiment in session_in_common(1.0) {
                create(kept_as(folder, &experiment))?;
            }
        }
        let picture = |path: PathBuf| NewFile::picture(path, ask.force);
        Ok(Self {
            calibration: ask.output.clone().map(create).transpose()?,
            model: ask.model_output.clone().map(create).transpose()?,
            picture: ask.picture.clone().map(picture).transpose()?,
            trial: ask.trial.clone().map(create).transpose()?,
        })
    }

    /// `board` is what it calls itself, and the calibration that it had. What is not written is an error for after the report.
    fn write(
        self,
        calibrated: &Calibrated,
        board: (String, String),
    ) -> (Written, Result<(), OutputError>) {
        let mut files = KeptFiles::new();
        let picture = sheet(&before_and_after(&calibrated.before, &calibrated.after));
        let tried = Tried::new(
            board,
            &calibrated.calibration,
            not_inverted(calibrated),
            (calibrated.before.clone(), calibrated.after.clone()),
        );
        let written = Written {
            calibration: files
                .write_calibration(self.calibration, &to_toml(&calibrated.calibration)),
            model: files.write(self.model, &calibrated.model.to_toml()),
            picture: files.write(self.picture, &picture),
            trial: files.write(self.trial, &tried.to_json()),
        };
        (written, files.ended())
    }
}

/// The model to start from.
fn start(ask: &Calibrate) -> Result<Model, ToolError> {
    let mut start = model(&ask.model)?;
    if let Some(cold) = ask.cold_resistance {
        start.parameters.cold_resistance_ohm = cold.ohm;
        start.by_actuator.remove(&Symbol::ColdResistance);
    }
    Ok(start)
}

/// The bench that measures. Where the heaters' cold resistance is given, the board has them as `start` on trial from here on.
async fn bench<'a>(
    board: &'a Board,
    ask: &Calibrate,
    sensor: Sensor,
    start: &Model,
    json: bool,
) -> Result<Bench<'a>, ToolError> {
    if ask.cold_resistance.is_some() {
        watch_as(board, start).await?;
    }
    if !sensor.is_there(board).await? {
        return Err(SensorFault::NoSensor.into());
    }
    // Small currents tell the cold resistance, and an offset would be part of it.
    Interrupt::listen()?
        .or(calibrate_sense::zero(board))
        .await?;
    let bench = Bench::open(board, sensor, None, json).await?;
    Ok(bench.with_sensor_lag(ask.sensor_lag))
}

/// Has the board watch its heaters as those of a model. One that has turned itself off because they are others is cleared then.
async fn watch_as(board: &Board, model: &Model) -> Result<(), ToolError> {
    let calibration = tabulate(model)?.calibration;
    board
        .use_calibration(&calibration, CalibrationUse::OnTrial)
        .await?;
    board.clear().await?;
    Ok(())
}

/// What is asked for on this board.
async fn procedure(
    board: &Board,
    ask: &Calibrate,
    sensor: &Sensor,
    (device, start): (String, Model),
) -> Result<Procedure, ToolError> {
    let status = board.status().await?;
    Ok(Procedure {
        start,
        device,
        date: today(),
        max_v: decimal(status.max_drive_v),
        reach_um: decimal(status.max_position_um),
        reads_every_tick: matches!(sensor, Sensor::Board),
        effort: if ask.quick {
            Effort::QUICK
        } else {
            Effort::USUAL
        },
    })
}

/// The name of the mirror: as the user calls it, or as the board does.
fn device(board: &Board, name: Option<String>) -> Result<String, ToolError> {
    let name = name.unwrap_or_else(|| board.identity().board.as_str().to_owned());
    match Label::new(&name) {
        Some(_) if !name.trim().is_empty() => Ok(name),
        _ => Err(ToolError::Name { name }),
    }
}

/// How long it takes.
fn time_words(played: &[(Part, Experiment)]) -> String {
    let minutes = |part: Part| {
        let of_it = played.iter().filter(|(of, _)| *of == part);
        of_it.fold(0.0, |sum, (_, played)| sum + played.duration_s()) / 60.0
    };
    let (measuring, refining) = (minutes(Part::Session), minutes(Part::Refining));
    let (trying, checking) = (minutes(Part::Before), minutes(Part::DriftCheck));
    format!(
        "takes {:.0} min of the board's time: {measuring:.1} to measure, {refining:.1} to refine, twice {trying:.1} to try, \
         {checking:.1} to see that nothing moves meanwhile",
        measuring + refining + 2.0 * trying + checking
    )
}

/// Which experiments of a session are not in one that was cut short, or that is another.
fn lacks(session: &Session, max_v: f64) -> Option<String> {
    let is_there = |name: &str| {
        let mut files = session.files.iter();
        files.any(|(file, _)| Path::new(file).file_stem().is_some_and(|stem| stem == name))
    };
    let wanted = session_in_common(max_v).into_iter().map(|one| one.name);
    let missing: Vec<String> = wanted.filter(|name| !is_there(name)).collect();
    (!missing.is_empty()).then(|| {
        format!(
            "the mirror is identified from what is there, without {}; `calibrate --keep` measures all of it",
            missing.join(", ")
        )
    })
}

/// What will be played: a session that was measured before is not.
fn played(procedure: &Procedure, source: &Source) -> Vec<(Part, Experiment)> {
    let is_measured = matches!(source, Source::Mirror);
    let mut played = procedure.experiments();
    played.retain(|(part, _)| *part != Part::Session || is_measured);
    played
}

/// After `error` the channels are off, and the board has the calibration of before.
pub(super) async fn fall_back(board: &Board, error: ToolError) -> ToolError {
    let reverted = board.revert_calibration().await;
    let off = board.off().await;
    match reverted.and(off.map(drop)) {
        Ok(_) => error,
        Err(_) => ToolError::TrialLeft {
            reason: error.to_string(),
        },
    }
}

/// What of the model the board does not invert, in words.
fn not_inverted(calibrated: &Calibrated) -> Vec<String> {
    let left = calibrated.not_inverted.iter();
    left.map(|left| format!("{}: {}", left.effect, left.because))
        .collect()
}

/// How far a level plate may tilt in the middle of its range (95 %), with levers of a small plate where nobody knows them.
fn tilt_uncertainty_deg(calibration: &Calibration) -> f64 {
    const COVERAGE: f64 = 1.96;
    /// Half of a plate of half a millimetre, less the 20 um at its edge by which the actuators hold it.
    const SHORT: Micrometre = Micrometre(230.0);
    let parts = calibration.parts();
    let middle_um = 0.5 * calibration.max_position().0;
    let levers = match parts.plate.is_known() {
        true => parts.plate,
        false => Plate::cross(SHORT),
    };
    let plate = PlateInverse::new(&levers, calibration.max_position());
    let deviation = plate.tilt_deviation(&[parts.residual.apart * middle_um; CHANNELS]);
    COVERAGE * decimal(deviation.0).to_degrees()
}

fn report(
    calibrated: Calibrated,
    had: &mirror_protocol::CalibrationInfo,
    range: RangeEnd,
    written: Written,
) -> CalibrateReport {
    let not_inverted = not_inverted(&calibrated);
    let model = &calibrated.model;
    CalibrateReport {
        device: model.provenance.device.clone().unwrap_or_default(),
        date: model.provenance.date.clone().unwrap_or_default(),
        model_hash: format!("{:016x}", calibration::model_hash(model)),
        uncertainty_before_k: status::uncertainty_k(had, [None; 4]),
        cold_resistance_ohm: std::array::from_fn(|actuator| {
            let parameters = model.actuator(actuator).parameters;
            parameters.get(Symbol::ColdResistance)
        }),
        not_inverted,
        refined_rms_um: calibrated.refined_rms_um,
        rest_um: calibrated.rest_um,
        tilt_uncertainty_deg: tilt_uncertainty_deg(&calibrated.calibration),
        room_unknown: RoomUnknown::of(&calibrated.calibration, calibrated.refined_rms_um.is_some()),
        range,
        moved_um: calibrated.moved_um,
        readings: calibrated.readings,
        calibrated_before: status::calibrated_words(had),
        before: calibrated.before.figures(),
        after: calibrated.after.figures(),
        identified: calibrated.identified,
        written,
    }
}
