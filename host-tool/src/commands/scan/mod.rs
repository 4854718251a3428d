//! `scan`: positions and poses along a sine, a triangle, a circle, a figure, a raster or a table of one's own, played by the board.

mod not_held;
mod path;
mod spot;
mod table;

use std::fmt;
use std::path::PathBuf;

use calibration::PlatePose;
use control_core::{Limit, Limits};
use experiments::{Beginnings, Experiment, Run, Signal};
use measurement::MeasurementFile;
use quantities::{Hold, Span};
use serde::Serialize;

use self::path::{Planned, TiltReport};
use self::spot::SensorSpot;
use crate::board::{Board, lowest_um};
use crate::cli::Scan;
use crate::commands::following::{Following, falls_short, range};
use crate::commands::measure::run::{Bench, Ended, whole};
use crate::commands::measure::sensor::Sensor;
use crate::commands::pose::reach;
use crate::error::ToolError;
use crate::names::{BANDWIDTH, limit_names, limited_line};
use crate::new_file::NewFile;
use crate::report;
use crate::verbosity::note;

/// What a mirror remembers is told from here on (um): twice what positions at rest are right to, 0.05 um rms (docs/figures/positioning.md).
const TOLD_UM: f64 = 0.1;
/// Samples of a scan, evenly over its length.
const SAMPLES: u32 = 2000;
/// Samples in a line at least, so that a row tells one beginning, and at most so many in all.
const SAMPLES_PER_LINE: u32 = 4;
const MOST_SAMPLES: u32 = 500_000;

#[derive(Serialize)]
struct ScanReport {
    file: Option<PathBuf>,
    samples: usize,
    duration_s: f64,
    lowest_um: Option<f64>,
    highest_um: Option<f64>,
    /// The lowest and highest position that the mirror was to come to, by the board's calibration; `None` where that is on trial.
    expected_um: Option<[f64; 2]>,
    /// What was asked and reached, after the jump that several cycles begin with; `None` without a sensor, and where the scan failed.
    following: Option<Following>,
    /// Where the sensor's spot is, where that explains most of the error.
    spot: Option<SensorSpot>,
    /// About x and y, where tilts were asked for.
    tilts: Option<[TiltReport; 2]>,
    /// Frames and lines that began, as far as samples tell.
    frames: usize,
    lines: usize,
    limited_by: Vec<&'static str>,
    interrupted: bool,
}

/// Scans, and leaves the channels off.
pub(super) async fn run(
    board: &Board,
    scan: Scan,
    longest: Hold,
    json: bool,
) -> Result<(), ToolError> {
    let tick_hz = board.identity().tick_hz;
    let Planned { name, run, output } = path::planned(scan, tick_hz)?;
    check_length(run.duration_s(), longest)?;
    let before = board.status().await?;
    let reach = reach(board, &before).await?;
    path::check_reach(&run, &reach.by_range())?;
    let experiment = Experiment::scan(name, run.clone(), samples(run.begins, run.cycles));
    experiment_player::pieces(&experiment, tick_hz)?;
    let file = output
        .map(|(path, force)| NewFile::create(path, force))
        .transpose()?;
    let (signal, cycles) = (&run.signal, run.cycles);
    if let Some(warning) = not_held::warning(&run, &reach) {
        note(warning);
    }
    let expected = expected(board, &run).await?;
    let expected_um = expected
        .as_ref()
        .map(|poses| range(poses.iter().map(|(_, pose)| pose.z_um)));
    if let Some(warning) = expected_um.and_then(|expected_um| short_of(signal, expected_um)) {
        note(warning);
    }
    let tilts = TiltReport::both(&run, expected.as_deref());
    if let Some(warning) = tilts.iter().flatten().find_map(TiltReport::short_of) {
        note(warning);
    }
    let mut bench = Bench::open(board, Sensor::Board, None, json).await?;
    let mut measured = bench.measure(&experiment).await;
    let counts_from_um = bench.counts_from_um();
    bench.close();
    if let Some(remembered_um) = counts_from_um {
        count_from_calibrated_rest(board, remembered_um, &mut measured.file).await;
    }
    let tick_s = 1.0 / f64::from(tick_hz);
    for row in &mut measured.file.rows {
        let t_s = (row.t_s - 0.5 * tick_s).max(0.0);
        row.asked_um = Some(signal.at(t_s));
        if run.tilts.is_some() {
            let [x, y] = run.tilts_at(t_s).map(f64::to_degrees);
            (row.asked_tilt_x_deg, row.asked_tilt_y_deg) = (Some(x), Some(y));
        }
    }
    let rows = &measured.file.rows;
    let began = |bit: u8| {
        rows.iter()
            .filter(move |row| row.trigger.is_some_and(|bits| bits & bit != 0))
    };
    let z = || rows.iter().filter_map(|row| row.z_um);
    let jump_s = jump_s(cycles, signal.period_s());
    let following = follows(&measured.ended)
        .then(|| Following::of(signal, rows, jump_s, tick_s))
        .flatten();
    let spot = following.and_then(|_| SensorSpot::of(rows, jump_s));
    let falls_short = following.is_some_and(|following| following.falls_short());
    let acted = limit_names(acted(&measured.limits, jump_s / run.duration_s()).bits());
    let mut report = ScanReport {
        file: None,
        samples: rows.len(),
        duration_s: rows.last().map_or(0.0, |row| row.t_s),
        lowest_um: z().min_by(f64::total_cmp),
        highest_um: z().max_by(f64::total_cmp),
        expected_um,
        following,
        spot,
        tilts,
        frames: began(1).count(),
        lines: began(2).count(),
        limited_by: limited_by(acted, falls_short),
        interrupted: is_interrupted(&measured.ended),
    };
    if let Some(file) = file.filter(|_| !rows.is_empty()) {
        report.file = Some(file.write(&measured.file.to_string())?);
    }
    report::print(&report, json);
    whole(measured.ended)
}

/// Whether all samples are of a mirror that was driven along the scan: where it failed, as by another tool's `off`, the last ones are of the ramp
/// down, until the board has said so.
fn follows(ended: &Result<Ended, ToolError>) -> bool {
    ended.is_ok()
}

/// Whether the scan ended before it was over, by Ctrl-C or as it failed.
fn is_interrupted(ended: &Result<Ended, ToolError>) -> bool {
    !matches!(ended, Ok(Ended::Complete))
}

/// Whether whoever runs the bench lets a mirror be driven for so long.
fn check_length(duration_s: f64, longest: Hold) -> Result<(), ToolError> {
    let lasts = Span { s: duration_s };
    match longest {
        Hold::For(allowed) if lasts.s > allowed.s => Err(ToolError::ScanTooLong { lasts, longest }),
        _ => Ok(()),
    }
}

/// Positions count from the calibration's rest, in its room. In a warmer one the mirror rests higher, by what the board knows of it once it was
/// driven; and where it was driven before, at `remembered_um` as the scan begins, by what it has not forgotten, which hysteresis, creep and slow heat
/// hold it at: the room is not in it. What was measured is kept whatever the board answers.
async fn count_from_calibrated_rest(board: &Board, remembered_um: f64, file: &mut MeasurementFile) {
    let Ok(status) = board.status().await else {
        return;
    };
    let rest_um = lowest_um(&status.health);
    if rest_um > 0.0 {
        note(format!(
            "the room is warmer than at calibration, and the mirror rests at {rest_um:.1} um by what the board knows of it: what was reached \
             counts from there"
        ));
    }
    if remembered_um.abs() > TOLD_UM {
        note(format!(
            "the mirror was {remembered_um:+.2} um from its rest when the scan began, by what the board knows of earlier drives: what was \
             reached counts from there"
        ));
    }
    let displacements = file.rows.iter_mut().filter_map(|row| row.z_um.as_mut());
    displacements.for_each(|z_um| *z_um += rest_um + remembered_um);
}

/// How often a scan with these beginnings in each of its cycles is sampled.
fn samples(begins: Beginnings, cycles: u32) -> u32 {
    let most = u32::from(begins.frames.max(begins.lines));
    let of_lines = most.saturating_mul(cycles).saturating_mul(SAMPLES_PER_LINE);
    of_lines.clamp(SAMPLES, MOST_SAMPLES)
}

/// Where the mirror will come by the calibration in use, in one cycle; `None` where the board does not tell it.
async fn expected(board: &Board, run: &Run) -> Result<Option<Vec<(f64, PlatePose)>>, ToolError> {
    let calibration = board.settled_calibration().await?;
    Ok(calibration.map(|calibration| {
        calibration::reached(
            &calibration,
            |t_s| PlatePose::along(run, t_s),
            run.signal.period_s(),
        )
    }))
}

/// Says so where the mirror will hardly go as far as it is asked to.
fn short_of(signal: &Signal, [low_um, high_um]: [f64; 2]) -> Option<String> {
    let (lowest_um, highest_um) = signal.range();
    falls_short([lowest_um, highest_um], [low_um, high_um]).then(|| {
        format!(
            "beyond the mirror's bandwidth: asked for {lowest_um:.3} to {highest_um:.3} um, it will come to {low_um:.3} to \
             {high_um:.3} um by its heat and its plate; slow it down"
        )
    })
}

/// A step has come to 95 % after so long on a board as the factory left it (s; "step, time to 95 %" of docs/guide/calibrate.md).
const STEP_S: f64 = 0.1;

/// How long a scan takes to come from rest to where it goes round, which does not count (s): the cycles in which a step comes there, at least
/// one and at most half of them; of a single cycle the step alone.
fn jump_s(cycles: u32, period_s: f64) -> f64 {
    if cycles == 1 {
        return STEP_S.min(0.5 * period_s);
    }
    let step = (STEP_S / period_s).ceil() as u32;
    f64::from(step.clamp(1, (cycles / 2).max(1))) * period_s
}

/// The limits that acted on the way, after this part of it.
fn acted(limits: &[Limits], jump: f64) -> Limits {
    let first = (limits.len() as f64 * jump).ceil() as usize;
    let all = limits.iter().skip(first);
    all.fold(Limits::NONE, |all, limits| all.union(*limits))
}

/// What held the scan back: limits of the board's that `acted`, or else the mirror, where it falls short.
fn limited_by(acted: Vec<&'static str>, falls_short: bool) -> Vec<&'static str> {
    match acted.is_empty() && falls_short {
        true => vec![BANDWIDTH],
        false => acted,
    }
}

/// The same as a line for people.
fn limited(by: &[&str]) -> String {
    match by {
        [BANDWIDTH] => limited_line(&["by the mirror's bandwidth"]),
        by => limited_line(by),
    }
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
        if let Some(spot) = &self.spot {
            writeln!(f, "{spot}")?;
        }
        for (about, tilt) in ["x", "y"].iter().zip(self.tilts.iter().flatten()) {
            writeln!(f, "tilt {about}     {tilt}")?;
        }
        if self.tilts.is_some() {
            writeln!(
                f,
                "           what calibration and room leave of the tilts comes besides, and nothing reads it: `set-pose` says how much"
            )?;
        }
        if self.lines > 0 {
            writeln!(f, "triggers   {} frames, {} lines", self.frames, self.lines)?;
        }
        let falls_short = self
            .following
            .is_some_and(|following| following.falls_short());
        writeln!(f, "{}", limited(&self.limited_by))?;
        if self.limited_by.contains(&Limit::Cooling.name()) {
            writeln!(
                f,
                "           it falls faster than the mirror cools: raise its lower end or slow it down"
            )?;
        }
        if falls_short {
            writeln!(
                f,
                "           it moves less than 0.7 of what was asked: slow it down"
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

    #[test]
    fn a_scan_lasts_no_longer_than_a_bench_allows() {
        let longest = Hold::For(Span { s: 10.0 });
        assert!(check_length(10.0, longest).is_ok());
        assert!(check_length(1e6, Hold::Forever).is_ok());
        let said = check_length(1000.0, longest).expect_err("too long");
        let said = said.to_string();
        assert!(
            said.contains("for 1000 s, longer than this bench allows, 10 s"),
            "{said}"
        );
    }

    #[test]
    fn a_scan_that_another_tool_ended_is_interrupted_and_its_ramp_down_follows_nothing() {
        let off = || {
            Err(ToolError::Refused {
                request: "go on",
                refusal: mirror_protocol::Refusal::NoHello,
            })
        };
        assert!(is_interrupted(&off()) && !follows(&off()));
        let by_hand = Ok(Ended::Interrupted);
        assert!(is_interrupted(&by_hand) && follows(&by_hand));
        let whole = Ok(Ended::Complete);
        assert!(!is_interrupted(&whole) && follows(&whole));
    }

    #[test]
    fn the_jump_that_a_scan_begins_with_is_not_its_limit() {
        let mut jump = Limits::NONE;
        jump.insert(Limit::DriveHigh);
        let mut fall = Limits::NONE;
        fall.insert(Limit::Cooling);
        let mut limits = vec![Limits::NONE; 11];
        limits[0] = jump;
        assert_eq!(acted(&limits, 1.0 / 3.0), Limits::NONE);
        // A single slow cycle is sampled every 10 ms and more.
        assert_eq!(acted(&limits, 1e-3), Limits::NONE);
        limits[4] = fall;
        assert_eq!(acted(&limits, 1.0 / 3.0), fall);
        assert_eq!(acted(&[], 1.0 / 3.0), Limits::NONE);
    }

    #[test]
    fn a_jump_takes_as_long_as_a_step_and_leaves_half_of_the_scan() {
        for (cycles, period_s, jump_cycles) in [
            (1, 0.05, 0.5),
            (2, 1.0, 1.0),
            (10, 1.0, 1.0),
            (10, 0.04, 3.0),
            (200, 5e-4, 100.0),
            (3, 5e-4, 1.0),
        ] {
            let expected_s = jump_cycles * period_s;
            // One rounding.
            let off = jump_s(cycles, period_s) / expected_s - 1.0;
            assert!(off.abs() < 1e-12, "{cycles}");
        }
        assert_eq!(jump_s(1, 20.0), STEP_S);
        assert!(jump_s(u32::MAX, 1e-300).is_finite());
    }

    #[test]
    fn what_the_board_does_not_hold_back_the_mirror_may() {
        for (acted, falls_short, by, told) in [
            (vec![], false, vec![], "by nothing"),
            (vec![], true, vec!["bandwidth"], "by the mirror's bandwidth"),
            (vec!["cooling"], true, vec!["cooling"], "cooling"),
        ] {
            let limited_by = limited_by(acted, falls_short);
            assert_eq!(limited_by, by);
            assert_eq!(limited(&limited_by), format!("limited    {told}"));
        }
    }

    #[test]
    fn every_line_has_some_samples() {
        let lines = |lines| Beginnings { frames: 2, lines };
        assert_eq!(samples(lines(0), 3), SAMPLES);
        assert_eq!(samples(lines(1000), 3), 12_000);
        assert_eq!(samples(lines(u16::MAX), u32::MAX), MOST_SAMPLES);
    }
}
