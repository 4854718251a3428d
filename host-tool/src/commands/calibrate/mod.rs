//! `calibrate`: teaches a board its mirror. Measure, identify, build the tables, correct them by what the mirror does under
//! them, and try the result at other positions than those it was made from.

mod effort;
mod picture;
mod report;
mod teach;
mod trial;

use std::path::{Path, PathBuf};

use calibration::{tabulate, to_toml};
use control_core::Calibration;
use control_core::calibration::Label;
use identification::{Dataset, Identification};
use measurement::Session;
use mirror_model::{Model, Symbol};
use mirror_protocol::CalibrationUse;

use self::effort::Effort;
use self::report::Report;
use self::trial::{Trial, complete};
use crate::board::Board;
use crate::cli::Calibrate;
use crate::commands::measure::experiment::{Experiment, in_common};
use crate::commands::measure::run::{Lab, today};
use crate::commands::measure::sensor::Sensor;
use crate::commands::{calibrate_sense, status};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::quantity::Voltage;
use crate::report::{decimal, print};

/// Calibrates `board`. Until the new calibration has been tried to the end it is on trial: whatever goes wrong before, the
/// board has the one of before again, and its channels are off.
pub(super) async fn run(board: &Board, ask: Calibrate, json: bool) -> Result<(), ToolError> {
    let start = Model::load(&ask.model)?;
    let device = device(board, ask.device)?;
    let file = |path: Option<PathBuf>| {
        path.map(|path| NewFile::create(path, ask.force))
            .transpose()
    };
    let (calibration_file, model_file, picture_file) = (
        file(ask.output)?,
        file(ask.model_output)?,
        file(ask.picture)?,
    );
    let sensor = Sensor::open(&ask.sensor)?;
    let status = board.status().await?;
    let reads_every_tick = matches!(sensor, Sensor::Board);
    if reads_every_tick && status.telemetry.sensor_z_um.is_none() {
        return Err(ToolError::NoSensor);
    }
    // A tool that was killed may have left one on trial.
    let had = board.revert_calibration().await?;
    // Small currents tell the cold resistance, and an offset would be part of it.
    calibrate_sense::zero(board).await?;
    let mut lab = Lab::open(board, sensor, None, json).await?;

    let bench = Bench {
        board,
        start,
        device,
        max: Voltage {
            v: decimal(status.max_drive_v),
        },
        reach_um: decimal(status.max_position_um),
        reads_every_tick,
        effort: if ask.quick {
            Effort::QUICK
        } else {
            Effort::USUAL
        },
    };
    let source = match &ask.from {
        Some(folder) => Source::Files(Session::load(&[folder])?),
        None => Source::Mirror {
            keep: ask.keep.as_deref(),
            force: ask.force,
        },
    };
    let taught = bench.teach(&mut lab, source).await;
    lab.close();
    let Taught {
        model,
        identified,
        not_inverted,
        calibration,
        left_um,
        before,
        after,
    } = match taught {
        Ok(taught) => taught,
        Err(error) => return Err(bench.fall_back(error).await),
    };

    let write =
        |file: Option<NewFile>, text: String| file.map(|file| file.write(&text)).transpose();
    let report = Report {
        device: model.provenance.device.clone().unwrap_or_default(),
        date: model.provenance.date.clone().unwrap_or_default(),
        model_hash: format!("{:016x}", calibration::model_hash(&model)),
        uncertainty_before_k: status::uncertainty_k(&had, [None; 4]),
        cold_resistance_ohm: std::array::from_fn(|actuator| {
            let parameters = model.actuator(actuator).parameters;
            parameters.get(Symbol::ColdResistance)
        }),
        identified,
        not_inverted,
        refined_rms_um: left_um,
        calibrated_before: status::calibrated_words(&had),
        before: before.figures(),
        after: after.figures(),
        calibration: write(calibration_file, to_toml(&calibration))?,
        model: write(model_file, model.to_toml())?,
        picture: write(picture_file, picture::before_and_after(&before, &after)?)?,
    };
    print(&report, json);
    Ok(())
}

/// The name of the mirror: as the user calls it, or as the board does.
fn device(board: &Board, name: Option<String>) -> Result<String, ToolError> {
    let name = name.unwrap_or_else(|| board.identity().board.as_str().to_owned());
    match Label::new(&name) {
        Some(_) => Ok(name),
        None => Err(ToolError::Name { name }),
    }
}

/// A board to be taught, and what is known of it.
struct Bench<'a> {
    board: &'a Board,
    /// The model that identification starts from.
    start: Model,
    /// What the mirror is called.
    device: String,
    /// Highest drive.
    max: Voltage,
    /// Top of the range under the calibration that the board has (um).
    reach_um: f64,
    /// Whether displacements come with every tick, from the board's own sensor.
    reads_every_tick: bool,
    effort: Effort,
}

/// Where the measurements come from that the mirror is identified by.
enum Source<'a> {
    Files(Session),
    /// It is measured, and the files are kept where that is asked for.
    Mirror {
        keep: Option<&'a Path>,
        force: bool,
    },
}

/// A calibration that is in use for good, and the way to it.
struct Taught {
    model: Model,
    identified: Identification,
    not_inverted: Vec<String>,
    calibration: Calibration,
    /// What the refined stages leave of the displacement (um, root mean square).
    left_um: Option<f64>,
    before: Trial,
    after: Trial,
}

impl Bench<'_> {
    async fn teach(&self, lab: &mut Lab<'_>, source: Source<'_>) -> Result<Taught, ToolError> {
        self.announce(lab, &source)?;
        let session = match source {
            Source::Files(session) => session,
            Source::Mirror { keep, force } => measure(lab, self.max, keep, force).await?,
        };
        let (mut model, identified) = {
            let start = self.start.clone();
            let identify = move || {
                let files: Vec<_> = session.files.iter().map(|(name, _)| name.clone()).collect();
                identification::identify(&start, &Dataset::new(&session), &files)
            };
            lab.aside("identifying", identify).await??
        };
        model.provenance.device = Some(self.device.clone());
        model.provenance.date = Some(today());
        model.parameters.drive_limit_v = self.max.v;
        let tabulated = tabulate(&model)?;
        let first = tabulated.calibration;
        let top_um = teach::RANGE * self.reach_um.min(decimal(first.max_position().0));
        let before = Trial::run(lab, &self.effort, "before", top_um).await?;
        lab.say("a first calibration is on trial; Ctrl-C brings back the one before");
        let (calibration, left_um) = if self.reads_every_tick {
            let (refined, left_um) = teach::refine(lab, self.board, &self.effort, first).await?;
            (refined, Some(left_um))
        } else {
            (teach::correct(lab, self.board, first).await?, None)
        };
        let after = Trial::run(lab, &self.effort, "after", top_um).await?;
        self.board
            .use_calibration(&calibration, CalibrationUse::ForGood)
            .await?;
        let not_inverted = tabulated.remaining.iter();
        Ok(Taught {
            model,
            identified,
            not_inverted: not_inverted
                .map(|left| format!("{}: {}", left.effect, left.because))
                .collect(),
            calibration,
            left_um,
            before,
            after,
        })
    }

    /// Says how long it takes.
    fn announce(&self, lab: &Lab<'_>, source: &Source<'_>) -> Result<(), ToolError> {
        let tick_hz = lab.tick_hz();
        let minutes = |experiments: &[Experiment]| {
            let seconds = experiments
                .iter()
                .map(|experiment| experiment.duration_s(tick_hz));
            seconds.sum::<f64>() / 60.0
        };
        let measuring = match source {
            Source::Files(_) => 0.0,
            Source::Mirror { .. } => minutes(&in_common(self.max, tick_hz)?),
        };
        let teaching = if self.reads_every_tick {
            minutes(&teach::moves(&self.effort, self.reach_um, tick_hz)?)
        } else {
            teach::ROUNDS as f64 * minutes(&[teach::rests(self.reach_um, tick_hz)?])
        };
        let trying = minutes(&trial::experiments(&self.effort, self.reach_um, tick_hz)?);
        lab.say(&format!(
            "takes {:.0} min of the board's time: {measuring:.1} to measure, {teaching:.1} to refine, twice {trying:.1} to try",
            measuring + teaching + 2.0 * trying
        ));
        Ok(())
    }

    /// After `error` the channels are off, and the board has the calibration of before.
    async fn fall_back(&self, error: ToolError) -> ToolError {
        let reverted = self.board.revert_calibration().await;
        let off = self.board.off().await;
        match reverted.and(off.map(drop)) {
            Ok(_) => error,
            Err(_) => ToolError::TrialLeft {
                reason: error.to_string(),
            },
        }
    }
}

/// Measures the session that an identification wants, and keeps its files where that is asked for.
async fn measure(
    lab: &mut Lab<'_>,
    max: Voltage,
    keep: Option<&Path>,
    force: bool,
) -> Result<Session, ToolError> {
    let mut session = Session::default();
    for experiment in in_common(max, lab.tick_hz())? {
        let name = format!("{}.csv", experiment.name);
        let file = match keep {
            Some(folder) => {
                std::fs::create_dir_all(folder).map_err(|source| ToolError::Write {
                    path: folder.to_owned(),
                    source,
                })?;
                Some(NewFile::create(folder.join(&name), force)?)
            }
            None => None,
        };
        let measured = lab.measure(&experiment).await;
        if let Some(file) = file {
            file.write(&measured.file.to_string())?;
        }
        session.files.push((name, complete(measured)?));
    }
    Ok(session)
}
