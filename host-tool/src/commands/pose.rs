//! Poses as people write and read them, in micrometres and degrees.

use std::fmt;

use calibration::{PlatePose, Reach};
use control_core::calibration::{Lever, Plate};
use control_core::{CHANNELS, Micrometre};
use mirror_protocol::{CalibrationInfo, Pose};
use serde::Serialize;

use crate::quantity::{Angle, Length};
use crate::report::decimal;

/// A pose that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TiltedPose {
    z_um: f64,
    tilt_x_deg: f64,
    tilt_y_deg: f64,
}

/// A pose as a board tells it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct PlateReport {
    z_um: f64,
    /// `None` where the calibration does not know the plate's levers.
    tilt_x_deg: Option<f64>,
    tilt_y_deg: Option<f64>,
}

impl TiltedPose {
    pub(super) fn new(z: Length, tilt_x: Angle, tilt_y: Angle) -> Self {
        Self {
            z_um: z.um,
            tilt_x_deg: tilt_x.deg,
            tilt_y_deg: tilt_y.deg,
        }
    }

    pub(super) fn is_level(&self) -> bool {
        self.tilt_x_deg == 0.0 && self.tilt_y_deg == 0.0
    }
}

impl From<TiltedPose> for PlatePose {
    fn from(pose: TiltedPose) -> Self {
        Self {
            z_um: pose.z_um,
            tilt_x_rad: pose.tilt_x_deg.to_radians(),
            tilt_y_rad: pose.tilt_y_deg.to_radians(),
        }
    }
}

impl From<PlatePose> for TiltedPose {
    fn from(pose: PlatePose) -> Self {
        Self {
            z_um: pose.z_um,
            tilt_x_deg: pose.tilt_x_rad.to_degrees(),
            tilt_y_deg: pose.tilt_y_rad.to_degrees(),
        }
    }
}

impl From<&Pose> for PlateReport {
    fn from(pose: &Pose) -> Self {
        let tilt_deg = |i: usize| {
            let tilts = pose.tilt_rad;
            tilts.map(|rad| decimal(rad[i]).to_degrees())
        };
        Self {
            z_um: decimal(pose.z_um),
            tilt_x_deg: tilt_deg(0),
            tilt_y_deg: tilt_deg(1),
        }
    }
}

impl fmt::Display for TiltedPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.3} um with {:+.4} deg about x and {:+.4} deg about y",
            self.z_um, self.tilt_x_deg, self.tilt_y_deg
        )
    }
}

impl fmt::Display for PlateReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>9.3} um", self.z_um)?;
        match (self.tilt_x_deg, self.tilt_y_deg) {
            (Some(x), Some(y)) => write!(f, "  {x:>+8.4} deg about x  {y:>+8.4} deg about y"),
            _ => f.write_str("  tilts unknown: the calibration has no levers"),
        }
    }
}

/// What the mirror reaches under the calibration in use.
pub(super) fn reach(calibration: &CalibrationInfo) -> Reach {
    let levers: [Lever; CHANNELS] = calibration.levers.map(|lever| Lever {
        x: Micrometre(lever.x_um),
        y: Micrometre(lever.y_um),
        warp: lever.warp,
    });
    Reach::new(Plate { levers }, decimal(calibration.max_position_um))
}
