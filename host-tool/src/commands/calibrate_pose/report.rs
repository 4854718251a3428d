//! What `calibrate-pose` says at its end.

use std::fmt;
use std::path::PathBuf;

use calibration::Posed;
use serde::Serialize;

use super::readings::PoseSession;
use super::trial::Trial;
use crate::commands::range_end::RangeEnd;
use crate::report::{decimal, row};

#[derive(Serialize)]
pub(super) struct CalibratePoseReport {
    /// Spots of the sensor that were read; none where an instrument of two axes was.
    spots: usize,
    poses: usize,
    /// Poses on the way besides, which tell how fast each actuator follows, or why there are none; neither where an instrument was read.
    on_the_way: Option<usize>,
    not_told: Option<&'static str>,
    /// What the calibration leaves of the poses that it was made of (root mean square).
    piston_rms_um: f64,
    tilt_rms_deg: f64,
    /// How far the plate was from where it was asked to be under the last spot, with assumed levers and with what was found (um, root
    /// mean square); `None` where nothing was tried.
    before_um: Option<f64>,
    after_um: Option<f64>,
    /// Where the actuators act on the plate (um), and their parts in the warp.
    levers: [[f64; 3]; 4],
    /// By how much each actuator is slower than the thermal poles say (s).
    slower_by_s: [f64; 4],
    /// Parts of the thermal poles that all four actuators share, the fast ones first.
    shared: Vec<f64>,
    range: RangeEnd,
    pub(super) calibration: Option<PathBuf>,
}

impl CalibratePoseReport {
    /// The range of before ended at `before_um`.
    pub(super) fn of_spots(
        found: &Posed,
        before_um: f64,
        session: &PoseSession,
        (on_the_way, trial): (Result<usize, &'static str>, &Trial),
    ) -> Self {
        let poses = session
            .spots
            .first()
            .map_or(0, |spot| spot.heights().z_um.len());
        Self {
            spots: session.spots.len(),
            on_the_way: on_the_way.ok(),
            not_told: on_the_way.err(),
            before_um: Some(trial.before_um),
            after_um: Some(trial.after_um),
            ..Self::of_a_file(found, poses, before_um)
        }
    }

    pub(super) fn of_a_file(found: &Posed, poses: usize, before_um: f64) -> Self {
        let parts = found.calibration.parts();
        Self {
            spots: 0,
            poses,
            on_the_way: None,
            not_told: None,
            piston_rms_um: found.piston_rms_um,
            tilt_rms_deg: found.tilt_rms_rad.to_degrees(),
            before_um: None,
            after_um: None,
            levers: parts
                .plate
                .levers
                .map(|lever| [lever.x.0, lever.y.0, lever.warp].map(decimal)),
            slower_by_s: parts
                .actuators
                .each_ref()
                .map(|actuator| decimal(actuator.slower_by.0)),
            shared: parts.heat.shared.map(decimal).to_vec(),
            range: RangeEnd::new(before_um, &found.calibration),
            calibration: None,
        }
    }
}

impl fmt::Display for CalibratePoseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spots {
            0 => writeln!(f, "measured   {} poses", self.poses)?,
            spots => writeln!(
                f,
                "measured   {} poses under each of {spots} spots",
                self.poses
            )?,
        }
        if let Some(count) = self.on_the_way {
            writeln!(f, "on the way {count} poses")?;
        }
        if let Some(why) = self.not_told {
            writeln!(f, "           {why}")?;
        }
        writeln!(
            f,
            "left       {:.3} um and {:.4} deg rms",
            self.piston_rms_um, self.tilt_rms_deg
        )?;
        for (actuator, [x, y, warp]) in (1..).zip(self.levers) {
            writeln!(
                f,
                "lever {actuator}    x {x:>8.1} um  y {y:>8.1} um  warp {warp:>+6.3}"
            )?;
        }
        let us = self.slower_by_s.map(|s| 1e6 * s);
        writeln!(f, "slower by  {}", row(us, 1, "us"))?;
        if let (Some(before), Some(after)) = (self.before_um, self.after_um) {
            writeln!(
                f,
                "tried      {before:.3} um rms before, {after:.3} um now, under the last spot"
            )?;
        }
        write!(f, "{}", self.range)?;
        match &self.calibration {
            Some(file) => writeln!(f, "written    {}", file.display()),
            None => Ok(()),
        }
    }
}
