//! A pose as people write it, in micrometres and degrees.

use std::fmt;

use calibration::PlatePose;
use quantities::{Angle, Length};
use serde::Serialize;

/// A pose that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TiltedPose {
    z_um: f64,
    tilt_x_deg: f64,
    tilt_y_deg: f64,
}

impl TiltedPose {
    pub(crate) fn new(z: Length, tilt_x: Angle, tilt_y: Angle) -> Self {
        Self {
            z_um: z.um,
            tilt_x_deg: tilt_x.deg,
            tilt_y_deg: tilt_y.deg,
        }
    }

    pub(crate) fn is_level(&self) -> bool {
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

impl fmt::Display for TiltedPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.3} um with {:+.4} deg about x and {:+.4} deg about y",
            self.z_um, self.tilt_x_deg, self.tilt_y_deg
        )
    }
}
