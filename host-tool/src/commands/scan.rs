//! `scan`: positions along a sine, a triangle or a waveform of one's own, played by the board.

use std::fmt;
use std::path::{Path, PathBuf};

use control_core::{Limit, Limits};
use experiments::{Experiment, Signal, Wave};
use mirror_protocol::{Kept, POINTS};
use serde::Serialize;

use crate::board::Board;
use crate::cli::{Curve, Scan};
use crate::commands::following::{FOLLOWED, Following};
use crate::commands::measure::readings::parse;
use crate::commands::measure::run::{Bench, Ended, whole};
use crate::commands::measure::sensor::Sensor;
use crate::error::ToolError;
use crate::names::{limit_names, limited_line};
use crate::new_file::NewFile;
use crate::quantity::Length;
use crate::report::{self, decimal};
use crate::verbosity::note;

/// Samples of a scan, evenly over its length.
const SAMPLES: u32 = 2000;

#[derive(Serialize)]
struct ScanReport {
    file: Option<PathBuf>,
    samples: usize,
    duration_s: f64,
    lowest_um: Option<f64>,
    highest_um: Option<f64>,
    /// The lowest and highest position that the mirror was to come to, by the board's calibration; `None` where that is on trial.
    expected_um: Option<[f64; 2]>,
    /// What was asked and reached, after the first of several cycles; `None` without a sensor.
    following: Option<Following>,
    limited_by: Vec<&'static str>,
    interrupted: bool,
}

/// Scans, and leaves the channels off.
pub(super) async fn run(board: &Board, scan: Scan, json: bool) -> Result<(), ToolError> {
    let tick_hz = board.identity().tick_hz;
    let (name, signal, cycles, output) = signal(scan, tick_hz)?;
    let max_um = decimal(board.status().await?.max_position_um);
    let (lowest_um, highest_um) = signal.range();
    for um in [lowest_um, highest_um] {
        if !(-1e-3..=max_um + 1e-3).contains(&um) {
            return Err(ToolError::PositionOutOfRange {
                asked: Length { um },
                max: Length { um: max_um },
            });
        }
    }
    let experiment = Experiment::along(name, signal.clone(), cycles, SAMPLES);
    experiment_player::pieces(&experiment, tick_hz)?;
    let file = output
        .map(|(path, force)| NewFile::create(path, force))
        .transpose()?;
    let expected_um = expected_um(board, &signal).await?;
    if let Some(warning) = expected_um.and_then(|expected_um| short_of(&signal, expected_um)) {
        note(warning);
    }
    let mut bench = Bench::open(board, Sensor::Board, None, json).await?;
    let mut measured = bench.measure(&experiment).await;
    bench.close();
    let tick_s = 1.0 / f64::from(tick_hz);
    for row in &mut measured.file.rows {
        row.asked_um = Some(signal.at((row.t_s - 0.5 * tick_s).max(0.0)));
    }
    let rows = &measured.file.rows;
    let z = || rows.iter().filter_map(|row| row.z_um);
    let mut report = ScanReport {
        file: None,
        samples: rows.len(),
        duration_s: rows.last().map_or(0.0, |row| row.t_s),
        lowest_um: z().min_by(f64::total_cmp),
        highest_um: z().max_by(f64::total_cmp),
        expected_um,
        following: Following::of(&signal, rows, jump_s(&signal, cycles), tick_s),
        limited_by: limit_names(acted(&measured.limits, cycles).bits()),
        interrupted: matches!(measured.ended, Ok(Ended::Interrupted)),
    };
    if let Some(file) = file.filter(|_| !rows.is_empty()) {
        report.file = Some(file.write(&measured.file.to_string())?);
    }
    report::print(&report, json);
    whole(measured.ended)
}

/// Where the mirror will come by the calibration in use; `None` where that is on trial, and the board tells the one before.
async fn expected_um(board: &Board, signal: &Signal) -> Result<Option<[f64; 2]>, ToolError> {
    if board.calibration().await?.kept == Kept::OnTrial {
        return Ok(None);
    }
    let calibration = board.settled_calibration().await?;
    Ok(calibration.map(|calibration| {
        calibration::reached_um(&calibration, |t_s| signal.at(t_s), signal.period_s())
    }))
}

/// Says so where the mirror will hardly go as far as it is asked to.
fn short_of(signal: &Signal, [low_um, high_um]: [f64; 2]) -> Option<String> {
    let (lowest_um, highest_um) = signal.range();
    let is_short = high_um - low_um < FOLLOWED * (highest_um - lowest_um);
    is_short.then(|| {
        format!(
            "beyond the mirror's bandwidth: asked for {lowest_um:.3} to {highest_um:.3} um, it will come to {low_um:.3} to \
             {high_um:.3} um by its heat and its plate; slow it down"
        )
    })
}

/// How long the jump from rest counts (s): the first of several cycles.
fn jump_s(signal: &Signal, cycles: u32) -> f64 {
    if cycles > 1 { signal.period_s() } else { 0.0 }
}

/// The limits that acted on the way; the first of several cycles begins with a jump from rest, and does not count.
fn acted(limits: &[Limits], cycles: u32) -> Limits {
    let first = if cycles > 1 {
        limits.len().div_ceil(cycles as usize)
    } else {
        0
    };
    let all = limits.iter().skip(first);
    all.fold(Limits::NONE, |all, limits| all.union(*limits))
}

/// Name, positions (um), cycles, and the file that may be asked for.
type Planned = (&'static str, Signal, u32, Option<(PathBuf, bool)>);

fn signal(scan: Scan, tick_hz: u32) -> Result<Planned, ToolError> {
    let wave = |curve: &Curve| Wave {
        mean: curve.offset.um,
        amplitude: curve.amplitude.um,
        frequency_hz: curve.frequency.hz,
    };
    Ok(match scan {
        Scan::Sine { curve, to } => {
            let signal = Signal::Sine(wave(&curve));
            ("scan_sine", signal, curve.cycles, to.file())
        }
        Scan::Triangle { curve, to } => {
            let signal = Signal::Triangle(wave(&curve));
            ("scan_triangle", signal, curve.cycles, to.file())
        }
        Scan::Csv { file, cycles, to } => {
            let (values, dwell_ticks) = read(&file, tick_hz)?;
            let dwell_s = f64::from(dwell_ticks) / f64::from(tick_hz);
            let signal = Signal::Lines { values, dwell_s };
            ("scan_csv", signal, cycles, to.file())
        }
    })
}

/// A waveform's positions at equal steps of time, and the ticks of one step.
fn read(path: &Path, tick_hz: u32) -> Result<(Vec<f64>, u32), ToolError> {
    let unusable = |reason: String| ToolError::Waveform {
        path: path.to_owned(),
        reason,
    };
    let text = input_file::read_text(path, input_file::MOST_MADE)?;
    let points = parse(&text).map_err(unusable)?;
    let [(first_s, _), .., (last_s, _)] = points[..] else {
        return Err(unusable("it has fewer than two points".into()));
    };
    // As dense as the board's table allows, and no denser than the control ticks.
    let ticks = (last_s - first_s) * f64::from(tick_hz);
    let dwell_ticks = (ticks / (POINTS - 1) as f64).ceil().max(1.0);
    let steps = (ticks / dwell_ticks).round();
    if steps < 1.0 || dwell_ticks > f64::from(u32::MAX) {
        return Err(unusable(
            "it is shorter than a control tick, or longer than 100 h".into(),
        ));
    }
    let at = |t_s: f64| {
        let after = points
            .partition_point(|(t, _)| *t < t_s)
            .clamp(1, points.len() - 1);
        let ((t0, z0), (t1, z1)) = (points[after - 1], points[after]);
        z0 + ((t_s - t0) / (t1 - t0)).clamp(0.0, 1.0) * (z1 - z0)
    };
    let z_um =
        (0..=steps as u32).map(|step| at(first_s + (last_s - first_s) * f64::from(step) / steps));
    Ok((z_um.collect(), dwell_ticks as u32))
}

impl fmt::Display for ScanReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "scanned    {:.3} s, {} samples",
            self.duration_s, self.samples
        )?;
        if let Some(following) = &self.following {
            write!(f, "{following}")?;
        }
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        if self.limited_by.contains(&Limit::Cooling.name()) {
            writeln!(
                f,
                "           it falls faster than the mirror cools: raise its lower end or slow it down"
            )?;
        }
        if self
            .following
            .is_some_and(|following| following.falls_short())
        {
            writeln!(
                f,
                "           it moves less than 0.7 of what was asked: beyond its bandwidth, so slow it down"
            )?;
        }
        if let Some(file) = &self.file {
            writeln!(f, "kept       in {}", file.display())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Write;

    fn read_text(text: &str) -> Result<(Vec<f64>, u32), ToolError> {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(text.as_bytes()).expect("written");
        read(file.path(), 10_000)
    }

    #[test]
    fn a_file_that_is_no_waveform_is_told_why() {
        for (text, reason) in [
            ("", "fewer than two points"),
            ("0,1\n", "fewer than two points"),
            ("0,1\n1\n", "line 2"),
            ("1,1\n0,2\n", "line 2 is not later"),
            ("0,1\n1e-6,2\n", "shorter than a control tick"),
        ] {
            let said = read_text(text).expect_err("unusable").to_string();
            assert!(said.contains(reason), "{said}");
        }
    }

    #[test]
    fn the_jump_that_a_scan_begins_with_is_not_its_limit() {
        let mut jump = Limits::NONE;
        jump.insert(Limit::DriveHigh);
        let mut fall = Limits::NONE;
        fall.insert(Limit::Cooling);
        let mut limits = vec![Limits::NONE; 11];
        limits[0] = jump;
        assert_eq!(acted(&limits, 3), Limits::NONE);
        assert_eq!(acted(&limits, 1), jump);
        limits[4] = fall;
        assert_eq!(acted(&limits, 3), fall);
        assert_eq!(acted(&[], 3), Limits::NONE);
    }

    proptest! {
        #[test]
        fn a_waveform_keeps_its_ends_and_its_length(
            z in proptest::collection::vec(0.0_f64..170.0, 2..700), step_s in 1e-3_f64..1.0,
        ) {
            let text: String = z
                .iter()
                .enumerate()
                .map(|(i, z)| format!("{:?},{z:?}\n", i as f64 * step_s))
                .collect();
            let (found, dwell_ticks) = read_text(&text).expect("a waveform");
            prop_assert!(found.len() <= POINTS);
            prop_assert!((found[0] - z[0]).abs() < 1e-9);
            prop_assert!((found[found.len() - 1] - z[z.len() - 1]).abs() < 1e-9);
            let asked = (z.len() - 1) as f64 * step_s * 1e4;
            let played = (found.len() - 1) as f64 * f64::from(dwell_ticks);
            prop_assert!((played - asked).abs() <= f64::from(dwell_ticks), "{played} for {asked}");
        }
    }
}
