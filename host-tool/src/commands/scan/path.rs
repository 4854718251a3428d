//! What a scan asks for, from the command line to the run that a board plays, and whether the mirror reaches it.

use std::fmt;
use std::path::PathBuf;

use calibration::{PlatePose, Reach};
use experiments::{Beginnings, Run, Signal, Tilt, Turns, Wave};
use quantities::{Angle, Length};
use serde::Serialize;

use super::table::{self, Sampled};
use crate::board::{check_piston, hardly_beyond};
use crate::cli::{Curve, Frame, Scan, TiltCurve};
use crate::commands::following::{Followed, falls_short};
use crate::commands::pose::nearest;
use crate::error::{BeyondBoard, ToolError};
use crate::verbosity::note;

/// Poses of a turn that are held against what the mirror reaches: straight lines between them pass by a sine's top by
/// (pi/360)^2/2, 4e-5 of its amplitude, which rounding of the core's range allows.
const POSES_PER_TURN: u32 = 360;
/// And so many of a cycle at most.
const MOST_POSES: u32 = 200_000;

/// A scan by its name in measurement files, and the file that may be asked for.
pub(super) struct Planned {
    pub(super) name: &'static str,
    pub(super) run: Run,
    pub(super) output: Option<(PathBuf, bool)>,
}

/// What is asked for, on a board with so many ticks a second.
pub(super) fn planned(scan: Scan, tick_hz: u32) -> Result<Planned, ToolError> {
    let (name, run, to) = match scan {
        Scan::Sine { curve, tilts, to } => {
            let run = beside(Signal::Sine(wave(&curve)), &curve, &tilts, Tilt::Sine);
            ("scan_sine", run, to)
        }
        Scan::Triangle { curve, tilts, to } => {
            let run = beside(
                Signal::Triangle(wave(&curve)),
                &curve,
                &tilts,
                Tilt::Triangle,
            );
            ("scan_triangle", run, to)
        }
        Scan::Circle { frame, radius, to } => {
            let tilt = |start| turns(Angle { deg: 0.0 }, radius, 1, start);
            let tilts = [Tilt::Sine(tilt(QUARTER)), Tilt::Sine(tilt(0.0))];
            ("scan_circle", held(&frame, 1.0, tilts), to)
        }
        Scan::Lissajous {
            frame,
            tilt_x,
            tilt_y,
            turns_x,
            turns_y,
            to,
        } => {
            let level = Angle { deg: 0.0 };
            let tilts = [
                Tilt::Sine(turns(level, tilt_x, turns_x, QUARTER)),
                Tilt::Sine(turns(level, tilt_y, turns_y, 0.0)),
            ];
            ("scan_lissajous", held(&frame, 1.0, tilts), to)
        }
        Scan::Raster {
            frame,
            tilt_x,
            tilt_y,
            lines,
            to,
        } => {
            // Both begin at their lowest. A cycle has a frame up and a frame down, and a turn of the fast axis two lines.
            let level = Angle { deg: 0.0 };
            let tilts = [
                Tilt::Triangle(turns(level, tilt_x, lines, 3.0 * QUARTER)),
                Tilt::Triangle(turns(level, tilt_y, 1, 3.0 * QUARTER)),
            ];
            let mut run = held(&frame, 0.5, tilts);
            run.begins = Beginnings {
                frames: 2,
                lines: 2 * lines,
            };
            ("scan_raster", run, to)
        }
        Scan::Csv { file, cycles, to } => {
            let sampled = table::read(&file, tick_hz)?;
            tell_missed(&sampled, tick_hz);
            let dwell_s = f64::from(sampled.dwell_ticks) / f64::from(tick_hz);
            let values = sampled.z_um;
            let rad = |deg: Vec<f64>| Tilt::Lines(deg.into_iter().map(f64::to_radians).collect());
            let run = Run {
                tilts: sampled.tilts_deg.map(|tilts| tilts.map(rad)),
                begins: ONE_FRAME,
                ..Run::along(Signal::Lines { values, dwell_s }, cycles)
            };
            ("scan_csv", run, to)
        }
    };
    Ok(Planned {
        name,
        run,
        output: to.file(),
    })
}

const QUARTER: f64 = 0.25;
const ONE_FRAME: Beginnings = Beginnings {
    frames: 1,
    lines: 0,
};

fn wave(curve: &Curve) -> Wave {
    Wave {
        mean: curve.offset.um,
        amplitude: curve.amplitude.um,
        frequency_hz: curve.frequency.hz,
    }
}

/// Tilts in step with the piston, where any are asked for.
fn beside(signal: Signal, curve: &Curve, asked: &TiltCurve, tilt: fn(Turns) -> Tilt) -> Run {
    let about = |middle, amplitude| tilt(turns(middle, amplitude, 1, 0.0));
    let tilts = [
        about(asked.middle_x, asked.tilt_x),
        about(asked.middle_y, asked.tilt_y),
    ];
    let is_level = tilts.iter().all(|tilt| tilt.range() == (0.0, 0.0));
    Run {
        tilts: (!is_level).then_some(tilts),
        begins: ONE_FRAME,
        ..Run::along(signal, curve.cycles)
    }
}

/// Tilts at a piston that is held, with so many cycles a frame.
fn held(frame: &Frame, cycles_per_frame: f64, tilts: [Tilt; 2]) -> Run {
    let signal = Signal::Sine(Wave {
        mean: frame.offset.um,
        amplitude: 0.0,
        frequency_hz: cycles_per_frame * frame.frequency.hz,
    });
    Run {
        tilts: Some(tilts),
        begins: ONE_FRAME,
        ..Run::along(signal, frame.cycles)
    }
}

fn turns(middle: Angle, amplitude: Angle, per_cycle: u16, start: f64) -> Turns {
    Turns {
        mean: middle.deg.to_radians(),
        amplitude: amplitude.deg.to_radians(),
        per_cycle,
        start,
    }
}

/// Says how far a table is missed that has more in it than the board's has room for, and where it takes another time.
fn tell_missed(sampled: &Sampled, tick_hz: u32) {
    let (um, deg) = sampled.missed;
    let steps = sampled.z_um.len() - 1;
    if sampled.is_missed() {
        note(format!(
            "a board plays a table in equal steps of time, {steps} of them here: straight lines between them pass by yours by up to {um:.3} um and {deg:.4} deg; \
             play it in parts to come closer"
        ));
    }
    if sampled.takes_another_time() {
        let seconds = |ticks: f64| ticks / f64::from(tick_hz);
        let dwell_ticks = f64::from(sampled.dwell_ticks);
        note(format!(
            "its steps are whole control ticks: once through it takes {:.4} s and not {:.4} s, and each cycle is so much {}; a table whose length \
             a step of some {} ms divides is met",
            seconds(sampled.played_ticks()),
            seconds(sampled.ticks),
            if sampled.played_ticks() < sampled.ticks {
                "earlier"
            } else {
                "later"
            },
            1e3 * seconds(dwell_ticks)
        ));
    }
}

/// Whether a mirror of this reach comes to everything that is asked for.
///
/// # Errors
/// The pose that is farthest out of reach, with the nearest that can be reached.
pub(super) fn check_reach(run: &Run, reach: &Reach) -> Result<(), BeyondBoard> {
    /// What a signal's arithmetic may leave at its ends (um).
    const ROUNDING_UM: f64 = 1e-3;
    let (low_um, high_um) = reach.level_um();
    let (lowest_um, highest_um) = run.signal.range();
    let is_at = |um: f64| move |end: &f64| (um - end).abs() < ROUNDING_UM;
    for um in [lowest_um, highest_um] {
        if ![low_um, high_um].iter().any(is_at(um)) {
            // No digits that arithmetic has left.
            let um = (1e6 * um).round() / 1e6;
            check_piston(Length { um }, (low_um, high_um))?;
        }
    }
    if run.tilts.is_none() {
        return Ok(());
    }
    if !reach.knows_tilts() {
        return Err(BeyondBoard::LeversUnknown);
    }
    let missed = |pose: &PlatePose| {
        let nearest = reach.nearest(pose);
        (pose.tilt_x_rad - nearest.tilt_x_rad).hypot(pose.tilt_y_rad - nearest.tilt_y_rad)
    };
    let borne = hardly_beyond(reach);
    let farthest = poses(run)
        .filter(|pose| !borne.contains(pose))
        .max_by(|a, b| missed(a).total_cmp(&missed(b)));
    match farthest {
        None => Ok(()),
        Some(pose) => Err(BeyondBoard::PoseOutOfReach {
            asked: Box::new(pose.into()),
            nearest: Box::new(nearest(&pose, reach)),
        }),
    }
}

/// The poses of a cycle, near enough to each other; of a table, those at its points, between which all others lie: what is reached
/// is convex.
pub(super) fn poses(run: &Run) -> impl Iterator<Item = PlatePose> {
    let per_cycle = |tilt: &Tilt| match tilt {
        Tilt::Sine(_) | Tilt::Triangle(_) => tilt.per_cycle() * POSES_PER_TURN,
        Tilt::Lines(values) => values.len().saturating_sub(1) as u32,
    };
    let counts = run.tilts.iter().flatten().map(per_cycle);
    let count = counts.max().unwrap_or(POSES_PER_TURN).clamp(1, MOST_POSES);
    let period_s = run.signal.period_s();
    (0..=count).map(move |index| {
        // The end of the last line is the start of the first again.
        let part = f64::from(index) / f64::from(count);
        PlatePose::along(run, (part * period_s).min(period_s * (1.0 - f64::EPSILON)))
    })
}

/// What was asked of a tilt, and what the calibration foresees of it: no sensor of the board tells tilts.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct TiltReport {
    /// Lowest and highest that was asked for.
    asked_deg: [f64; 2],
    /// Lowest and highest that the mirror comes to by its heat and its plate; `None` where the calibration is on trial.
    expected_deg: Option<[f64; 2]>,
    /// Expected less asked (root mean square).
    rms_error_deg: Option<f64>,
    /// How late the mirror is expected to be.
    lag_s: Option<f64>,
}

impl TiltReport {
    /// About x and y, where tilts are asked for, and of poses that are expected in a cycle.
    pub(super) fn both(run: &Run, expected: Option<&[(f64, PlatePose)]>) -> Option<[Self; 2]> {
        let tilts = run.tilts.as_ref()?;
        let about = |axis: usize| {
            let points = expected.map(|poses| -> Vec<(f64, f64)> {
                let rad = |pose: &PlatePose| [pose.tilt_x_rad, pose.tilt_y_rad][axis];
                poses
                    .iter()
                    .map(|(t_s, pose)| (*t_s, rad(pose).to_degrees()))
                    .collect()
            });
            let asked = |t_s: f64| run.tilts_at(t_s)[axis].to_degrees();
            // A lag of a whole turn is none.
            let period_s = run.signal.period_s() / f64::from(tilts[axis].per_cycle());
            let followed = points.and_then(|points| Followed::of(&points, asked, period_s));
            let (low, high) = tilts[axis].range();
            Self {
                asked_deg: [low.to_degrees(), high.to_degrees()],
                expected_deg: followed.map(|followed| followed.reached),
                rms_error_deg: followed.map(|followed| followed.rms_error),
                lag_s: followed.and_then(|followed| followed.lag_s),
            }
        };
        Some([about(0), about(1)])
    }

    /// Says so where the mirror will hardly tilt as far as it is asked to.
    pub(super) fn short_of(&self) -> Option<String> {
        let expected = self.expected_deg?;
        falls_short(self.asked_deg, expected)
            .then(|| format!("a tilt is beyond the mirror's bandwidth: {self}; slow it down"))
    }
}

impl fmt::Display for TiltReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.asked_deg;
        write!(f, "asked for {low:+.4} to {high:+.4} deg")?;
        if let (Some([low, high]), Some(rms)) = (self.expected_deg, self.rms_error_deg) {
            write!(
                f,
                ", by its heat and its plate it comes to {low:+.4} to {high:+.4} deg, which alone is {rms:.4} deg rms off"
            )?;
        }
        self.lag_s
            .map_or(Ok(()), |lag_s| write!(f, " and {:.2} ms late", 1e3 * lag_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Micrometre;
    use control_core::calibration::Plate;

    /// Of a plate with levers of 480 um.
    fn plate() -> Reach {
        Reach::new(Plate::cross(Micrometre(480.0)), 170.0)
    }

    fn circle(offset_um: f64, radius_deg: f64) -> Run {
        let radius = Angle { deg: radius_deg };
        let frame = Frame {
            offset: Length { um: offset_um },
            frequency: quantities::Frequency { hz: 5.0 },
            cycles: 2,
        };
        let tilt = |start| Tilt::Sine(turns(Angle { deg: 0.0 }, radius, 1, start));
        held(&frame, 1.0, [tilt(QUARTER), tilt(0.0)])
    }

    #[test]
    fn a_path_out_of_reach_is_told_by_its_farthest_pose_and_the_nearest_to_that() {
        assert!(check_reach(&circle(85.0, 5.0), &plate()).is_ok());
        // Near rest a tilt of 2 z over a lever is reached, about one axis at a time: 20 um are 4.77 degrees.
        assert!(check_reach(&circle(20.0, 2.0), &plate()).is_ok());
        let said = check_reach(&circle(20.0, 5.5), &plate()).expect_err("too far");
        let BeyondBoard::PoseOutOfReach { asked, nearest } = said else {
            panic!("{said}");
        };
        let (asked, nearest) = (PlatePose::from(*asked), PlatePose::from(*nearest));
        let tilt = |pose: &PlatePose| pose.tilt_x_rad.hypot(pose.tilt_y_rad).to_degrees();
        assert!(
            (tilt(&asked) - 5.5).abs() < 1e-6 && tilt(&nearest) < 4.78,
            "{asked:?} {nearest:?}"
        );
        let unknown = Reach::new(Plate::UNKNOWN, 170.0);
        assert!(matches!(
            check_reach(&circle(85.0, 1.0), &unknown),
            Err(BeyondBoard::LeversUnknown)
        ));
        let high = check_reach(&circle(171.0, 0.0), &plate());
        assert!(matches!(high, Err(BeyondBoard::PositionOutOfRange { .. })));
    }

    #[test]
    fn in_a_warm_room_a_path_begins_where_the_mirror_rests() {
        let warm = plate().above(30.0);
        assert!(check_reach(&circle(85.0, 5.0), &warm).is_ok());
        let low = check_reach(&circle(20.0, 0.0), &warm);
        assert!(matches!(low, Err(BeyondBoard::PositionBelowRoom { .. })));
        assert!(check_reach(&circle(35.0, 2.0), &warm).is_err());
        assert!(check_reach(&circle(35.0, 2.0), &plate()).is_ok());
        // Half a micrometre below is as good as there.
        assert!(check_reach(&circle(29.6, 0.0), &warm).is_ok());
        assert!(check_reach(&circle(29.4, 0.0), &warm).is_err());
    }

    #[test]
    fn the_last_point_of_a_table_is_looked_at_too() {
        let run = Run {
            tilts: Some([
                Tilt::Lines(vec![0.0, 0.0, 1.0]),
                Tilt::Lines(vec![0.0, 0.0, 0.0]),
            ]),
            ..Run::along(
                Signal::Lines {
                    values: vec![85.0; 3],
                    dwell_s: 0.1,
                },
                1,
            )
        };
        assert!(check_reach(&run, &plate()).is_err());
    }
}
