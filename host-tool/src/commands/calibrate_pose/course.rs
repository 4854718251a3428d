//! The course under a spot: poses on the way, which the board plays by itself, and what its own sensor reads at each step.
//!
//! They tell how fast each actuator follows. Under all spots the same is asked for at the same step, so that heights of one step are
//! heights of one pose.

use calibration::{
    COURSE_S, COURSE_STEP_S, PlatePose, PosePoint, Reach, SpotHeights, course, poses_over_spots,
};
use control_core::{Calibration, Controller, Limits};
use experiment_player::{Piece, decimal, pieces};
use experiments::{Experiment, Run};
use mirror_protocol::{Play, Telemetry};

use super::readings::{AlongPart, Spot, is_same, range_ends};
use crate::board::Board;
use crate::commands::moving::{Pace, check_states};
use crate::commands::pose::request;
use crate::error::ToolError;
use crate::verbosity::note;

/// Steps of a part.
const STEPS: usize = (0.5 * COURSE_S / COURSE_STEP_S).round() as usize;
/// The sensor's reading is the median of three ticks, in which one that stands alone bears no weight (`waveforms::Sampler`); of a way up or
/// down it is the one in the middle.
const MEDIAN_OF: u16 = 3;
/// From the middle of the tick whose value is the last that a reading sees to the sample with it (ticks): half a tick; the next one, in
/// which the value is driven; and one more, for the reading is of the tick before the sample.
const LATE_TICKS: f64 = 2.5;
/// More readings than this part that tell nothing are told of: a choice.
const MOST_SPOILT: f64 = 0.05;

/// The poses on the way, in two parts.
pub(super) struct Course {
    parts: [Part; 2],
}

/// A part of the course as the board plays it.
struct Part {
    begin: PlatePose,
    piece: Piece,
    /// What was asked last of what the reading of each step sees.
    asked: Vec<PlatePose>,
}

impl Course {
    /// That of the poses from rest to `top_um`, on a board that uses `calibration` and has so many ticks a second.
    pub(super) fn new(
        calibration: &Calibration,
        top_um: f64,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let reach = Reach::new(calibration.parts().plate, top_um);
        let [piston, tilts] = course(&reach, top_um);
        // The board asks for what it plays so much ahead.
        let mut calibration = *calibration;
        let ahead = Controller::new(&mut calibration).track_delay_ticks();
        let part = |run| Part::new(run, ahead.into(), tick_hz);
        Ok(Self {
            parts: [part(piston)?, part(tilts)?],
        })
    }

    /// Plays it from its beginning, held as any other pose: each part for itself, for a board plays one at a time.
    pub(super) async fn play(
        &self,
        board: &Board,
        pace: &Pace,
        rest_um: f64,
    ) -> Result<Vec<AlongPart>, ToolError> {
        let mut read = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            read.push(part.play(board, pace, rest_um).await?);
        }
        Ok(read)
    }

    /// Whether this may have been read along it.
    pub(super) fn is_along(&self, read: &[AlongPart]) -> bool {
        let lengths = |part: &AlongPart| part.z_um.len();
        read.iter()
            .map(lengths)
            .eq(self.parts.iter().map(|part| part.asked.len()))
    }

    /// What was asked, and the poses that the heights above all spots tell; nothing where a spot was not read along it.
    pub(super) fn points(&self, spots: &[Spot]) -> Vec<PosePoint> {
        if !spots.iter().all(|spot| self.is_along(&spot.course)) {
            return Vec::new();
        }
        let mut points = Vec::new();
        for (number, part) in self.parts.iter().enumerate() {
            let read: Vec<_> = spots
                .iter()
                .map(|spot| (spot.at_um, &spot.course[number]))
                .collect();
            points.extend(part.points(&read));
        }
        points
    }
}

/// How many of the points of a course were reached. Says so where many were not.
pub(super) fn count_reached(points: &[PosePoint]) -> usize {
    let reached = points
        .iter()
        .filter(|point| point.reached.is_some())
        .count();
    // Two are held before a part, and not read.
    let asked = points.len().saturating_sub(2);
    let spoilt = asked - reached;
    if spoilt as f64 > MOST_SPOILT * asked as f64 {
        note(format!(
            "{spoilt} of {asked} readings on the way are left out: a limit held the plate back, or the sensor read nothing or was at the end of \
             its range"
        ));
    }
    reached
}

impl Part {
    fn new(run: Run, ahead_ticks: f64, tick_hz: u32) -> Result<Self, ToolError> {
        let begin = PlatePose::along(&run, 0.0);
        let experiment = Experiment::scan("course", run.clone(), STEPS as u32);
        let [mut piece] = <[Piece; 1]>::try_from(pieces(&experiment, tick_hz)?).expect("one run");
        piece.waveform.ends_off = false;
        piece.stream.mean_ticks = MEDIAN_OF;
        let asked = (1..=STEPS).map(|step| {
            let sampled = step as f64 * f64::from(piece.stream.period_ticks);
            let ticks = sampled - LATE_TICKS + ahead_ticks;
            // Nothing is ahead of its end.
            PlatePose::along(&run, (ticks / f64::from(tick_hz)).min(run.duration_s()))
        });
        Ok(Self {
            begin,
            asked: asked.collect(),
            piece,
        })
    }

    async fn play(&self, board: &Board, pace: &Pace, rest_um: f64) -> Result<AlongPart, ToolError> {
        let lease_ms = pace.lease_ms();
        let commanded = board.set_pose(request(self.begin, lease_ms)).await?;
        board.wait(commanded.tick, pace.settle).await?;
        let play = Play {
            waveform: self.piece.waveform,
            stream: self.piece.stream,
            lease_ms,
        };
        let (mut stream, first_tick) = board.play(&play).await?;
        let mut samples = Vec::with_capacity(STEPS + 1);
        while let Some(sample) = stream.next_of_all().await? {
            check_states(&sample.states)?;
            samples.push(sample);
        }
        let held_s = board.span(commanded.tick, first_tick).s;
        // Where the lease lapsed before it, it began elsewhere.
        if held_s * 1e3 >= f64::from(lease_ms) {
            samples.clear();
        }
        Ok(AlongPart {
            held_s,
            z_um: self.read(&samples, first_tick, rest_um),
        })
    }

    /// What was read at each step (um), where the waveform was driven from a tick on.
    fn read(&self, samples: &[Telemetry], first_tick: u32, rest_um: f64) -> Vec<Option<f64>> {
        let mut z_um = vec![None; STEPS];
        for sample in samples {
            // The first sample is of the tick before, and of no step; one that was lost on the way leaves its step without.
            let ticks = sample.tick.wrapping_sub(first_tick).wrapping_add(1);
            let period_ticks = u32::from(self.piece.stream.period_ticks);
            let step = (ticks / period_ticks).checked_sub(1);
            if let Some(at) = step.and_then(|step| z_um.get_mut(step as usize)) {
                let is_held_back = Limits::from_bits(sample.limits).hold_back();
                let read = sample
                    .sensor_z_um
                    .filter(|um| um.is_finite() && !is_held_back);
                *at = read.map(|um| decimal(um) - rest_um);
            }
        }
        z_um
    }

    /// The points of this part, from what was read of it under each spot.
    fn points(&self, read: &[([f64; 2], &AlongPart)]) -> Vec<PosePoint> {
        let held_s = read.iter().map(|(_, along)| along.held_s);
        let mut points = vec![PosePoint {
            asked: self.begin,
            held_s: held_s.sum::<f64>() / read.len() as f64,
            reached: None,
            told_k: None,
        }];
        let within: Vec<_> = read
            .iter()
            .map(|(at_um, along)| (*at_um, self.within_range(*at_um, along)))
            .collect();
        points.extend(
            self.asked
                .iter()
                .enumerate()
                .map(|(step, asked)| PosePoint {
                    asked: *asked,
                    held_s: COURSE_STEP_S,
                    reached: reached(&within, step),
                    told_k: None,
                }),
        );
        points
    }

    /// What was read within the sensor's range.
    fn within_range(&self, at_um: [f64; 2], along: &AlongPart) -> Vec<Option<f64>> {
        let steps = along.z_um.iter().zip(&self.asked);
        let pairs: Vec<_> = steps
            .filter_map(|(um, asked)| Some(((*um)?, asked.height_um(at_um))))
            .collect();
        let ends = range_ends(&pairs);
        let is_within = |um: &f64| !ends.iter().any(|end| is_same(*um, *end));
        along.z_um.iter().map(|um| um.filter(is_within)).collect()
    }
}

/// The pose that the heights above all spots tell at a step; `None` where one is not known, or no plate has all of them.
fn reached(spots: &[([f64; 2], Vec<Option<f64>>)], step: usize) -> Option<PlatePose> {
    let height = |(at_um, z_um): &([f64; 2], Vec<Option<f64>>)| {
        Some(SpotHeights {
            at_um: *at_um,
            z_um: vec![z_um[step]?],
        })
    };
    let heights: Option<Vec<_>> = spots.iter().map(height).collect();
    poses_over_spots(&heights?).ok()?.pop()
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::calibration::{Parts, Plate};
    use control_core::{Limit, Micrometre};

    const TOP_UM: f64 = 160.0;
    const AT_UM: [[f64; 2]; 3] = [[-150.0, -150.0], [200.0, -100.0], [0.0, 200.0]];

    fn planned() -> Course {
        let text = include_str!("../../../../hil/tests/paper.toml");
        let calibration = calibration::from_toml("paper.toml", text).expect("a calibration");
        let calibration = Calibration::new(Parts {
            plate: Plate::cross(Micrometre(230.0)),
            ..*calibration.parts()
        });
        Course::new(&calibration.expect("with levers"), TOP_UM, 10_000).expect("playable")
    }

    /// A spot of a plate that is everywhere it was asked to be.
    fn spot(course: &Course, at_um: [f64; 2]) -> Spot {
        let along = |part: &Part| AlongPart {
            held_s: 2.0,
            z_um: part
                .asked
                .iter()
                .map(|asked| Some(asked.height_um(at_um)))
                .collect(),
        };
        Spot::new(at_um, Vec::new(), course.parts.iter().map(along).collect())
    }

    fn spots(course: &Course) -> Vec<Spot> {
        AT_UM.map(|at_um| spot(course, at_um)).to_vec()
    }

    #[test]
    fn what_is_asked_is_what_the_board_asks_for_in_the_tick_that_a_reading_sees() {
        let course = planned();
        let ahead = 2.75;
        let [piston, _] =
            calibration::course(&Reach::new(Plate::cross(Micrometre(230.0)), TOP_UM), TOP_UM);
        let part = Part::new(piston.clone(), ahead, 10_000).expect("playable");
        assert_eq!(part.piece.stream.period_ticks, 20);
        assert_eq!(part.piece.stream.count, 201);
        // The sample 20 ticks after the first has the reading of tick 19, whose beginning sees what is driven in tick 18, which is the value
        // of tick 17: that of its middle, and what the board looks ahead.
        let t_s = (17.0 + 0.5 + ahead) * 1e-4;
        assert!((part.asked[0].z_um - piston.signal.at(t_s)).abs() < 1e-9);
        assert!((part.asked[STEPS - 1].z_um - piston.signal.at(0.0)).abs() < 0.5);
        // The paper's plate rings at 1.1 kHz: half a period is 4.5 ticks, of which the mean is late by half.
        let begins = course.parts[0].asked[0].z_um;
        let rises_um_s = std::f64::consts::TAU * 20.0 * 0.06 * TOP_UM;
        let ticks = (begins - 0.45 * TOP_UM) / rises_um_s * 1e4;
        assert!((19.0..21.0).contains(&ticks), "{ticks}");
    }

    #[test]
    fn a_sample_is_of_its_step_whichever_are_lost() {
        let part = &planned().parts[0];
        let first_tick = u32::MAX - 100;
        let sample = |step: u32, um: f32| Telemetry {
            tick: first_tick.wrapping_sub(1).wrapping_add(20 * step),
            sensor_z_um: Some(um),
            ..Telemetry::default()
        };
        let mut limits = Limits::NONE;
        limits.insert(Limit::Cooling);
        let limited = Telemetry {
            limits: limits.bits(),
            ..sample(4, 74.0)
        };
        let samples = [
            sample(0, 70.0),
            sample(1, 71.0),
            sample(3, f32::NAN),
            limited,
            sample(200, 75.5),
        ];
        let read = part.read(&samples, first_tick, 1.0);
        assert_eq!(read.len(), STEPS);
        assert_eq!((read[0], read[STEPS - 1]), (Some(70.0), Some(74.5)));
        assert_eq!(read.iter().flatten().count(), 2);
    }

    #[test]
    fn heights_of_a_step_are_those_of_a_pose() {
        let course = planned();
        let mut read = spots(&course);
        let points = course.points(&read);
        assert_eq!(count_reached(&points), 2 * STEPS);
        for point in points {
            let (asked, Some(reached)) = (point.asked, point.reached) else {
                assert!((point.held_s - 2.0).abs() < 1e-12);
                continue;
            };
            assert!((asked.z_um - reached.z_um).abs() < 1e-9);
            assert!((asked.tilt_x_rad - reached.tilt_x_rad).abs() < 1e-9);
            assert!((asked.tilt_y_rad - reached.tilt_y_rad).abs() < 1e-9);
        }
        // A spot that was read by an earlier version, or by a serial sensor.
        read[1].course.clear();
        assert_eq!(course.points(&read), []);
    }

    #[test]
    fn a_step_that_is_spoilt_under_one_spot_is_no_pose() {
        let course = planned();
        let mut read = spots(&course);
        let top_um = 0.49 * TOP_UM;
        for um in read[0].course[0].z_um.iter_mut().flatten() {
            *um = um.min(top_um);
        }
        read[1].course[1].z_um[7] = None;
        let points = course.points(&read);
        let spoilt = |part: usize| {
            let steps = &points[1 + part * (STEPS + 1)..][..STEPS];
            let spoilt = steps.iter().filter(|point| point.reached.is_none()).count();
            (spoilt, steps[7].reached.is_none())
        };
        let beyond = course.parts[0]
            .asked
            .iter()
            .filter(|asked| asked.z_um >= top_um)
            .count();
        assert!(beyond > 40);
        assert_eq!(spoilt(0).0, beyond);
        assert_eq!(spoilt(1), (1, true));
        assert_eq!(count_reached(&points), 2 * STEPS - beyond - 1);
    }
}
