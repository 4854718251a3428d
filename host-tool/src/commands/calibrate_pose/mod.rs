//! `calibrate-pose`: levers and each actuator's own shape, from poses that a displacement sensor sees under three spots or more, one after
//! the other, or that an instrument of two axes has read.
//!
//! At each spot the plate goes through the same poses, and then along the same course. A spot's file is written when it is whole, so that
//! another call goes on with the next one.

mod course;
mod readings;
mod report;
mod table;
mod trial;

use calibration::{
    LeftOut, PlatePose, PoseError, PosePoint, Posed, are_on_a_line, check_from_rest, check_moved,
    posed, poses_over_spots, poses_to_measure, with_assumed_levers, with_broken_promise,
    without_surroundings,
};
use control_core::{Calibration, Limits};
use experiments::calibration::RANGE;
use mirror_protocol::CalibrationUse;
use quantities::Span;

use self::course::{Course, count_reached};
use self::readings::{AtPose, PoseSession, Spot};
use self::report::CalibratePoseReport;
use self::table::table;
use self::trial::{Trial, tried};
use super::calibrate::fall_back;
use super::calibration_file::load_in_use;
use super::interrupt::Interrupt;
use super::kept_files::KeptFiles;
use super::measure::keyboard::Keyboard;
use super::measure::possible::make_directory;
use super::measure::rested::Rested;
use super::measure::sensor::Sensor;
use super::measure::spots::Spots;
use super::moving::{self, Pace, Readings, UNTIL_THE_NEXT, check_lease};
use super::pose::{request, told_pose};
use crate::board::Board;
use crate::cli::CalibratePose;
use crate::error::{NotImproved, SensorFault, ToolError};
use crate::new_file::NewFile;
use crate::report::{self as reports, decimal};
use crate::verbosity::note;

/// A sensor's zero and the mirror together may go so far while a spot is read (um): it is taken out as a straight line of time.
const DRIFT_UM: f64 = 0.5;

/// Actuators that are turned around the plate by more than this (deg) are told: spots of a triangle that went round in a ring turn them by 120
/// or so, and axes along the plate's corners, not its actuators, by 45.
const TURNED_DEG: f64 = 60.0;

/// Why there is no course.
const READ_AT_REST: &str =
    "how fast each actuator follows is not told: it takes a sensor on the board's input";
const BEGUN_AT_REST: &str = "how fast each actuator follows is not told: spots in this folder were read at rest only; begin with another folder to \
     find it";

/// Measures spot after spot, or takes what an instrument has read, and keeps the calibration where the mirror follows it better.
pub(super) async fn run(board: &Board, ask: CalibratePose, json: bool) -> Result<(), ToolError> {
    let calibration = load_in_use(board, &ask.calibration).await?;
    let output = ask.output.map(|path| NewFile::create(path, ask.force));
    let output = output.transpose()?;
    if let Some(file) = ask.from {
        let points = table(&file)?;
        let found = posed(&with_assumed_levers(&calibration), &points);
        let found = found.map_err(ToolError::PosesOfTable)?;
        let report = CalibratePoseReport::of_a_file(
            &found,
            points.len(),
            decimal(calibration.max_position().0),
        );
        return keep(board, &found, output, report, json).await;
    }
    let begin = with_assumed_levers(&calibration);
    let plate = OnPlate::new(board, &begin, &ask.displacements.sensor, ask.settle).await?;
    let spots = Spots::new(ask.spots.as_deref())?;
    check_apart(spots.known())?;
    make_directory(&ask.session)?;
    let mut session = PoseSession::load(&ask.session, &plate.poses)?;
    session.check_spots(spots.known())?;
    let plate = plate.with_the_course_of(&session);
    let interrupt = Interrupt::listen()?;
    match interrupt.or(plate.measure(&mut session, spots)).await {
        Ok((found, report)) => keep(board, &found, output, report, json).await,
        Err(error) => Err(fall_back(board, error).await),
    }
}

/// What all four resistances told (K).
fn told_k(readings: &Readings) -> Option<[f64; 4]> {
    let [Some(a), Some(b), Some(c), Some(d)] = readings.temperature_rise_k else {
        return None;
    };
    Some([a, b, c, d])
}

/// Uses what was found for good, and says so.
async fn keep(
    board: &Board,
    found: &Posed,
    output: Option<NewFile>,
    mut report: CalibratePoseReport,
    json: bool,
) -> Result<(), ToolError> {
    let calibration = &found.calibration;
    let for_good = board.use_calibration(calibration, CalibrationUse::ForGood);
    for_good.await?;
    board.off().await?;
    let mut files = KeptFiles::new();
    for left_out in &found.left_out {
        note(alone(left_out));
    }
    if let Some(turn) = turn(found.turned_rad.to_degrees()) {
        note(turn);
    }
    report.calibration = files.write_calibration(output, &calibration::to_toml(calibration));
    reports::print(&report, json);
    Ok(files.ended()?)
}

/// Whether points that are known before any is read tell a pose: nobody moves a sensor for minutes to be refused then.
fn check_apart(known: &[[f64; 2]]) -> Result<(), PoseError> {
    match !known.is_empty() && are_on_a_line(known.iter().copied()) {
        true => Err(PoseError::SpotsOnALine),
        false => Ok(()),
    }
}

/// What to say of a pose whose reading stood alone.
fn alone(left_out: &LeftOut) -> String {
    let LeftOut {
        point,
        asked,
        off_um,
    } = left_out;
    let [x_deg, y_deg] = [asked.tilt_x_rad, asked.tilt_y_rad].map(f64::to_degrees);
    format!(
        "pose {}, {:.3} um with {x_deg:+.4} deg about x and {y_deg:+.4} deg about y, is left out: it was read {off_um:.2} um from where all others have \
         the plate; one reading of the sensor was wrong, or the mirror was jolted",
        point + 1,
        asked.z_um
    )
}

/// What to say of actuators that are turned around the plate by so many degrees.
fn turn(deg: f64) -> Option<String> {
    (deg.abs() > TURNED_DEG).then(|| {
        format!(
            "the actuators are turned by {deg:+.0} deg, from x towards y, against the calibration before, which has actuator 1 along x unless tilts \
             were measured; if your axes are not turned so, the spots were exchanged all round: read them again, in another folder"
        )
    })
}

/// A board under a calibration with levers, a sensor on its mirror, and the poses that are asked for.
struct OnPlate<'a> {
    board: &'a Board,
    begin: &'a Calibration,
    sensor: Sensor,
    pace: Pace,
    poses: Vec<PlatePose>,
    /// What the board plays under each spot after them, or why it does not.
    course: Result<Course, &'static str>,
    /// The highest level pose that is asked for (um).
    top_um: f64,
}

impl<'a> OnPlate<'a> {
    async fn new(
        board: &'a Board,
        begin: &'a Calibration,
        sensor: &str,
        settle: Span,
    ) -> Result<Self, ToolError> {
        let top_um = RANGE * decimal(begin.max_position().0);
        let reference = PlatePose {
            z_um: 0.5 * top_um,
            ..PlatePose::default()
        };
        let mut poses = vec![reference];
        poses.extend(poses_to_measure(begin, top_um));
        poses.push(reference);
        let sensor = Sensor::at_any_time(board, sensor).await?;
        let course = match sensor {
            Sensor::Board => Ok(Course::new(begin, top_um, board.identity().tick_hz)?),
            Sensor::Serial(_) | Sensor::Recording { .. } => Err(READ_AT_REST),
        };
        Ok(Self {
            board,
            begin,
            sensor,
            course,
            pace: Pace {
                settle,
                hold: UNTIL_THE_NEXT,
            },
            poses,
            top_um,
        })
    }

    /// Without a course where a spot of the session was read without one.
    fn with_the_course_of(self, session: &PoseSession) -> Self {
        let mut spots = session.spots.iter();
        let course = match self.course {
            Ok(course) if !spots.all(|spot| course.is_along(&spot.course)) => Err(BEGUN_AT_REST),
            course => course,
        };
        if let Err(why) = course {
            note(why);
        }
        Self { course, ..self }
    }

    /// Reads the spots that are not read yet, finds the plate, and tries what was found at the last spot.
    async fn measure(
        &self,
        session: &mut PoseSession,
        mut spots: Spots,
    ) -> Result<(Posed, CalibratePoseReport), ToolError> {
        self.put_on_trial(self.begin).await?;
        let minutes = self.poses.len() as f64 * (self.pace.settle.s + 0.2) / 60.0;
        note(format!(
            "{} poses at each spot, {minutes:.0} min; at least three spots, not on a line",
            self.poses.len()
        ));
        let mut keyboard = Keyboard::new();
        let kept = session.spots.len();
        while let Some(at_um) = spots.reach(session.spots.len(), &mut keyboard).await? {
            let (read, rest_um) = self.read(at_um, &self.poses).await?;
            let course = match &self.course {
                Ok(course) => course.play(self.board, &self.pace, rest_um).await?,
                Err(_) => Vec::new(),
            };
            self.board.off().await?;
            session.keep(Spot::new(at_um, read, course))?;
        }
        let mut points = self.points(session)?;
        let on_the_way = self.course.as_ref().map(|course| {
            let on_the_way = course.points(&session.spots);
            points.extend(&on_the_way);
            count_reached(&on_the_way)
        });
        let found = posed(self.begin, &points)?;
        let last = session.spots.last().ok_or(PoseError::SpotsOnALine)?;
        if session.spots.len() == kept {
            // Read in an earlier call, and the sensor may be anywhere since.
            let [x, y] = last.at_um;
            let question =
                format!("all points are read: move the spot to x {x} um, y {y} um, then Enter");
            keyboard.ask(&question).await?;
        }
        let poses = tried(&self.poses);
        self.put_on_trial(&found.calibration).await?;
        let before = last.with_read(tried(&last.read));
        let (after, _) = self.read(last.at_um, &poses).await?;
        self.board.off().await?;
        let after = last.with_read(after);
        let trial = Trial::new(&poses, (&before, &after), &found);
        trial.check()?;
        let report = CalibratePoseReport::of_spots(
            &found,
            decimal(self.begin.max_position().0),
            session,
            (on_the_way.map_err(|why| *why), &trial),
        );
        let calibration = with_broken_promise(&found.calibration, trial.times_promised());
        let found = Posed {
            calibration: calibration.map_err(PoseError::from)?,
            ..found
        };
        Ok((found, report))
    }

    /// As long as it is on trial the board leaves the mirror to the room: heat of a neighbour that the calibration does not know yet would be
    /// taken for a warm one. Whatever ends the trial brings the compensation back.
    async fn put_on_trial(&self, calibration: &Calibration) -> Result<(), ToolError> {
        let uncompensated = without_surroundings(calibration);
        let used = self
            .board
            .use_calibration(&uncompensated, CalibrationUse::OnTrial);
        used.await.map(drop)
    }

    /// What was asked, and the poses that the heights above all spots tell.
    fn points(&self, session: &PoseSession) -> Result<Vec<PosePoint>, ToolError> {
        let heights: Vec<_> = session.spots.iter().map(Spot::heights).collect();
        for spot in &session.spots {
            spot.check(&self.poses)?;
        }
        check_moved(&heights)?;
        check_from_rest(&heights, &self.poses)?;
        let reached = poses_over_spots(&heights)?;
        let points = self.poses.iter().zip(reached).enumerate();
        Ok(points
            .map(|(pose, (asked, reached))| PosePoint {
                asked: *asked,
                held_s: session.held_s(pose),
                reached: (!session.is_limited(pose)).then_some(reached),
                told_k: session.told_k(pose),
            })
            .collect())
    }

    /// How high the plate that nothing drives is above its rest under a spot, by what the board knows of hysteresis and creep (um): it creeps
    /// on while the sensor is waited for, under one spot longer than under another.
    async fn remembered_um(&self, at_um: [f64; 2]) -> Result<f64, ToolError> {
        let status = self.board.status().await?;
        Ok(told_pose(&status.telemetry.pose).height_um(at_um))
    }

    /// Heights of the plate under the sensor's spot at the poses, from rest, less what drifted meanwhile, and what the sensor reads of rest
    /// since (um). The last pose is held.
    async fn read(
        &self,
        at_um: [f64; 2],
        poses: &[PlatePose],
    ) -> Result<(Vec<AtPose>, f64), ToolError> {
        // Hysteresis holds a mirror off its rest by where it came from. From the top it comes to about the same rest each time: rests of their
        // own under three spots would be a tilt of all poses.
        let top = PlatePose {
            z_um: self.top_um,
            ..PlatePose::default()
        };
        self.read_at(&top).await?;
        note("letting the mirror come to rest");
        let rested = Rested::wait_for(self.board, &self.sensor).await?;
        if let Some(unrest) = rested.unrest() {
            note(unrest);
        }
        let mut rest_um = self.read_sensor(None).await? - self.remembered_um(at_um).await?;
        let mut read = Vec::with_capacity(poses.len());
        for pose in poses {
            let mut at = self.read_at(pose).await?;
            at.z_um -= rest_um;
            read.push(at);
        }
        if poses.first() == poses.last() {
            let drifted_um = readings::without_drift(&mut read);
            if drifted_um.abs() > DRIFT_UM {
                return Err(NotImproved::PoseDrift { drifted_um }.into());
            }
            rest_um += drifted_um;
        }
        Ok((read, rest_um))
    }

    async fn read_at(&self, pose: &PlatePose) -> Result<AtPose, ToolError> {
        let asked = request(*pose, self.pace.lease_ms());
        let commanded = self.board.set_pose(asked).await?;
        let (readings, held) =
            moving::read_settled(self.board, &commanded, self.pace.settle).await?;
        let z_um = self.read_sensor(readings.sensor_z_um).await?;
        let limits = Limits::from_bits(self.board.status().await?.telemetry.limits);
        // A slow sensor may have been read for longer than the pose is held.
        check_lease(limits)?;
        Ok(AtPose {
            z_um,
            held_s: held.s,
            is_limited: limits.hold_back(),
            told_k: told_k(&readings),
        })
    }

    /// What a serial sensor reads, or the board's, unless that was read already.
    async fn read_sensor(&self, read_um: Option<f64>) -> Result<f64, ToolError> {
        let um = match (self.sensor.read_now().await?, read_um) {
            (Some(um), _) | (None, Some(um)) => Some(um),
            (None, None) => moving::read(self.board).await?.0.sensor_z_um,
        };
        Ok(um.ok_or(SensorFault::NoSensor)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_nearly_on_a_line_are_refused_before_any_is_read() {
        let line = [[0.0, 0.0], [100.0, 0.0], [200.0, 1.0]];
        assert_eq!(check_apart(&line), Err(PoseError::SpotsOnALine));
        assert_eq!(
            check_apart(&[[0.0, 0.0], [100.0, 0.0], [200.0, 50.0]]),
            Ok(())
        );
        // They are typed.
        assert_eq!(check_apart(&[]), Ok(()));
    }

    #[test]
    fn a_pose_that_is_left_out_is_told_by_its_number() {
        let said = alone(&LeftOut {
            point: 30,
            asked: PlatePose::default(),
            off_um: 4.07,
        });
        assert!(said.starts_with("pose 31, 0.000 um"), "{said}");
        assert!(said.contains("4.07 um from"), "{said}");
    }

    #[test]
    fn axes_along_corners_are_no_exchange_of_spots() {
        assert_eq!(turn(45.0), None);
        let said = turn(-118.0).expect("told");
        assert!(said.contains("turned by -118 deg"), "{said}");
    }
}
