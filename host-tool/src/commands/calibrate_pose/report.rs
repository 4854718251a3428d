//! What `calibrate-pose` says at its end.

use std::fmt;
use std::path::PathBuf;

use calibration::Posed;
use serde::Serialize;

use super::readings::PoseSession;
use super::trial::Trial;
use crate::report::decimal;

#[derive(Serialize)]
pub(super) struct CalibratePoseReport {
    /// Spots of the sensor that were read; none where an instrument of two axes was.
    spots: usize,
    poses: usize,
    /// What the calibration leaves of the poses that it was made of (root mean square).
    piston_rms_um: f64,
    tilt_rms_deg: f64,
    /// How far the plate was from where it was asked to be under the last spot, with assumed levers and with what was found (um, root
    /// mean square); `None` where nothing was tried.
    before_um: Option<f64>,
    after_um: Option<f64>,
    /// Where the actuators act on the plate (um), and their parts in the warp.
    levers: [[f64; 3]; 4],
    /// Parts of the thermal poles that all four actuators share, the fast ones first.
    shared: Vec<f64>,
    pub(super) calibration: Option<PathBuf>,
}

impl CalibratePoseReport {
    pub(super) fn of_spots(found: &Posed, session: &PoseSession, trial: &Trial) -> Self {
        let poses = session
            .spots
            .first()
            .map_or(0, |spot| spot.heights().z_um.len());
        Self {
            spots: session.spots.len(),
            before_um: Some(trial.before_um),
            after_um: Some(trial.after_um),
            ..Self::of_a_file(found, poses)
        }
    }

    pub(super) fn of_a_file(found: &Posed, poses: usize) -> Self {
        let parts = found.calibration.parts();
        Self {
            spots: 0,
            poses,
            piston_rms_um: found.piston_rms_um,
            tilt_rms_deg: found.tilt_rms_rad.to_degrees(),
            before_um: None,
            after_um: None,
            levers: parts
                .plate
                .levers
                .map(|lever| [lever.x.0, lever.y.0, lever.warp].map(decimal)),
            shared: parts.heat.shared.map(decimal).to_vec(),
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
        if let (Some(before), Some(after)) = (self.before_um, self.after_um) {
            writeln!(
                f,
                "tried      {before:.3} um rms before, {after:.3} um now, under the last spot"
            )?;
        }
        match &self.calibration {
            Some(file) => writeln!(f, "written    {}", file.display()),
            None => Ok(()),
        }
    }
}
