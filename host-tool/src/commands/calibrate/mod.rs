//! `calibrate`: teaches a board its mirror. Measure, identify, build the tables, correct them by what is reached at rest,
//! and try the result at other positions than those it was made from.

mod picture;
mod trial;

use std::fmt;
use std::path::{Path, PathBuf};

use calibration::{JUMP_S, StaticPoint, corrected, jumps, refined, tabulate, to_toml};
use control_core::Calibration;
use control_core::design::COLD_RESISTANCE_TOLERANCE;
use diagnosis::{Identification, Plan};
use measurement::Session;
use mirror_model::Model;
use mirror_protocol::{Quantity, Shape, Waveform};
use serde::Serialize;

use self::trial::{Figures, Trial, complete, z_of};
use crate::board::Board;
use crate::cli::Calibrate;
use crate::commands::lab::while_working;
use crate::commands::measure::experiment::{Experiment, Reading, in_common};
use crate::commands::measure::run::{Ended, Lab, today};
use crate::commands::measure::sensor::Sensor;
use crate::commands::{calibrate_sense, status};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::quantity::{Span, Voltage};
use crate::report::{self, decimal, row};

/// Positions that the tables are corrected at, evenly over the range.
const POINTS: usize = 33;
/// From one of them to the next that is measured: the way jumps about as in use, where what the mirror remembers of the
/// way does not always point to the same side.
const JUMP: usize = 14;
/// A position is held so long before it is read.
const DWELL: Span = Span { s: 2.0 };
/// Corrections, each under the tables of the one before.
const ROUNDS: usize = 2;
/// Sines of positions (Hz), for what jumps do not tell: heat and friction while the mirror keeps moving; their middle and
/// amplitude as shares of the range, their cycles, the share of these in which the mirror is still on its way there, and their readings.
const SINES_HZ: [f64; 4] = [1.0, 5.0, 20.0, 100.0];
const SINE: (f64, f64) = (0.25, 0.12);
const SINE_CYCLES: u32 = 6;
const ON_ITS_WAY: f64 = 1.0 / 3.0;
const SINE_SAMPLES: u32 = 600;
/// The range that is used of what the highest drive reaches: up there nothing is left to correct with.
const RANGE: f64 = 0.99;

#[derive(Serialize)]
struct Report {
    device: String,
    date: String,
    model_hash: String,
    /// Resistance of each heater at ambient, as it was measured.
    cold_resistance_ohm: [f64; 4],
    /// How far temperatures could be off before that; `None` where it had been measured before.
    uncertainty_before_k: Option<[f64; 4]>,
    identified: Identification,
    /// Effects of the model that the board does not invert.
    not_inverted: Vec<String>,
    /// What the stages that were refined leave of the displacement on the way, root mean square; only a sensor that is read at
    /// every tick tells.
    refined_rms_um: Option<f64>,
    before: Figures,
    after: Figures,
    calibration: Option<PathBuf>,
    model: Option<PathBuf>,
    picture: Option<PathBuf>,
}

/// Calibrates `board`. Until the mirror is identified the board keeps the calibration that it had; from then on it has
/// the one that is being tried.
pub(super) async fn run(board: &Board, ask: Calibrate, json: bool) -> Result<(), ToolError> {
    let start = Model::load(&ask.model)?;
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
    if matches!(sensor, Sensor::Board) && status.telemetry.sensor_z_um.is_none() {
        return Err(ToolError::NoSensor);
    }
    let is_quick = matches!(sensor, Sensor::Board);
    let uncertainty_before_k = status::uncertainty_k(&board.calibration().await?, [None; 4]);
    // Small currents tell the cold resistance, and an offset would be part of it.
    calibrate_sense::zero(board).await?;
    let mut lab = Lab::open(board, sensor, None, json).await?;

    let max = Voltage {
        v: decimal(status.max_drive_v),
    };
    let session = match &ask.from {
        Some(folder) => Session::load(&[folder])?,
        None => measure(&mut lab, max, ask.keep.as_deref(), ask.force).await?,
    };
    let files: Vec<String> = session.files.iter().map(|(name, _)| name.clone()).collect();
    let plan = Plan::new(&session);
    let (mut model, identified) = lab.aside(|| {
        while_working("identifying", json, || {
            diagnosis::identify(&start, &plan, &files)
        })
    })?;
    model.provenance.device = Some(device(board, ask.device));
    model.provenance.date = Some(today());
    model.parameters.drive_limit_v = max.v;
    let tabulated = tabulate(&model)?;

    let top_um = RANGE
        * decimal(status.max_position_um).min(decimal(tabulated.calibration.max_position().0));
    let before = Trial::run(&mut lab, top_um).await?;
    let first = tabulated.calibration;
    let (calibration, left_um) = if is_quick {
        refine(&mut lab, board, first, json).await?
    } else {
        (correct(&mut lab, board, first).await?, None)
    };
    let after = Trial::run(&mut lab, top_um).await?;
    lab.close();

    let write =
        |file: Option<NewFile>, text: String| file.map(|file| file.write(&text)).transpose();
    let report = Report {
        device: model.provenance.device.clone().unwrap_or_default(),
        date: model.provenance.date.clone().unwrap_or_default(),
        model_hash: format!("{:016x}", calibration::model_hash(&model)),
        uncertainty_before_k,
        cold_resistance_ohm: calibration
            .lanes()
            .each_ref()
            .map(|lane| decimal(lane.cold_resistance.0)),
        identified,
        not_inverted: tabulated
            .remaining
            .iter()
            .map(|left| format!("{}: {}", left.effect, left.because))
            .collect(),
        refined_rms_um: left_um,
        before: before.figures(),
        after: after.figures(),
        calibration: write(calibration_file, to_toml(&calibration))?,
        model: write(model_file, model.to_toml())?,
        picture: write(picture_file, picture::before_and_after(&before, &after)?)?,
    };
    report::print(&report, json);
    Ok(())
}

/// The name of the mirror: as the user calls it, or as the board does, as far as it fits.
fn device(board: &Board, name: Option<String>) -> String {
    name.unwrap_or_else(|| {
        let board = board.identity().board.as_str();
        board
            .chars()
            .take(control_core::calibration::Label::CAPACITY / 2)
            .collect()
    })
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
        match measured.ended? {
            Ended::Complete => session.files.push((name, measured.file)),
            Ended::Interrupted => return Err(ToolError::Interrupted),
        }
    }
    Ok(session)
}

/// Uploads `calibration`, moves the mirror all over its range under it, and refines it by what the mirror did.
async fn refine(
    lab: &mut Lab<'_>,
    board: &Board,
    calibration: Calibration,
    json: bool,
) -> Result<(Calibration, Option<f64>), ToolError> {
    board.use_calibration(&calibration).await?;
    let top_um = RANGE * decimal(calibration.max_position().0);
    let positions: Vec<f64> = jumps().into_iter().map(|share| share * top_um).collect();
    let moves = Experiment::moves("moves", &positions, Span { s: JUMP_S }, lab.tick_hz())?;
    let mut experiments = vec![moves.after(30.0)];
    for hz in SINES_HZ {
        experiments.push(sine(hz, top_um, lab.tick_hz()));
    }
    let mut session = Session::default();
    for experiment in experiments {
        let mut file = complete(lab.measure(&experiment).await)?;
        if let Reading::Curve = experiment.reading {
            // It begins with a jump from rest.
            let settled_s = file.rows.last().map_or(0.0, |row| row.t_s) * ON_ITS_WAY;
            let unsettled = file.rows.iter_mut().filter(|row| row.t_s < settled_s);
            unsettled.for_each(|row| row.z_um = None);
        }
        session
            .files
            .push((format!("{}.csv", experiment.name), file));
    }
    let refined =
        lab.aside(|| while_working("refining", json, || refined(&calibration, &session)))?;
    board.use_calibration(&refined.calibration).await?;
    Ok((refined.calibration, Some(refined.residual_rms_um)))
}

/// A sine of positions in the lower half of the range.
fn sine(frequency_hz: f64, top_um: f64, tick_hz: u32) -> Experiment {
    let waveform = Waveform {
        quantity: Quantity::Position,
        shape: Shape::Sine {
            frequency_hz: frequency_hz as f32,
        },
        offset: (SINE.0 * top_um) as f32,
        amplitude: (SINE.1 * top_um) as f32,
        cycles: SINE_CYCLES,
        ends_off: true,
    };
    let name = format!("moves_{frequency_hz}");
    Experiment::positions_along(&name, waveform, Vec::new(), SINE_SAMPLES, tick_hz)
        .along_a_position()
        .after(2.0)
}

/// Uploads `calibration`, and bends its tables by what the board reaches under it.
async fn correct(
    lab: &mut Lab<'_>,
    board: &Board,
    mut calibration: Calibration,
) -> Result<Calibration, ToolError> {
    board.use_calibration(&calibration).await?;
    for _ in 0..ROUNDS {
        let top_um = RANGE * decimal(calibration.max_position().0);
        let position = |point: usize| top_um * (point + 1) as f64 / POINTS as f64;
        let way: Vec<usize> = (0..POINTS).map(|step| step * JUMP % POINTS).collect();
        // There and back: every position is reached once from below and once from above.
        let asked: Vec<f64> = way
            .iter()
            .chain(way.iter().rev())
            .map(|&point| position(point))
            .collect();
        let jumps = Experiment::positions("correcting", &asked, DWELL, lab.tick_hz())?.after(10.0);
        let reached = z_of(lab, &jumps).await?;
        let z = |row: usize| reached[row].1;
        let points: Vec<StaticPoint> = (0..POINTS)
            .map(|step| StaticPoint {
                asked_um: asked[step],
                reached_um: (z(step) + z(2 * POINTS - 1 - step)) / 2.0,
            })
            .collect();
        calibration = corrected(&calibration, &points)?;
        board.use_calibration(&calibration).await?;
    }
    Ok(calibration)
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "mirror     {}, {}, model {}",
            self.device, self.date, self.model_hash
        )?;
        writeln!(f, "cold       {}", row(self.cold_resistance_ohm, 1, "Ω"))?;
        if let Some([before_k, ..]) = self.uncertainty_before_k {
            writeln!(
                f,
                "           measured; before, it was known to {:.0} ohm, and warmth to {before_k:.1} K",
                COLD_RESISTANCE_TOLERANCE.0
            )?;
        }
        write!(f, "{}", self.identified)?;
        for left in &self.not_inverted {
            writeln!(f, "  not inverted by the board: {left}")?;
        }
        let rows = [
            (
                "error at rest, rms",
                "um",
                self.before.rest_rms_um,
                self.after.rest_rms_um,
            ),
            (
                "error at rest, largest",
                "um",
                self.before.rest_largest_um,
                self.after.rest_largest_um,
            ),
            (
                "step, time to 95 %",
                "ms",
                self.before.t95_ms,
                self.after.t95_ms,
            ),
            (
                "step, overshoot",
                "%",
                self.before.overshoot_percent,
                self.after.overshoot_percent,
            ),
            (
                "loop at 20 Hz",
                "um",
                self.before.loop_um,
                self.after.loop_um,
            ),
        ];
        writeln!(f, "{:<26} {:>10} {:>10}", "", "before", "after")?;
        for (what, unit, before, after) in rows {
            writeln!(f, "{what:<26} {before:>10.3} {after:>10.3} {unit}")?;
        }
        if let Some(left) = self.refined_rms_um {
            writeln!(
                f,
                "left by the refined stages while moving: {left:.3} um rms"
            )?;
        }
        let files = [
            ("calibration", &self.calibration),
            ("model", &self.model),
            ("picture", &self.picture),
        ];
        for (what, file) in files {
            if let Some(file) = file {
                writeln!(f, "{what:<12} in {}", file.display())?;
            }
        }
        Ok(())
    }
}
