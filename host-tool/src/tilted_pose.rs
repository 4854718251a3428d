//! A pose as people write it, in micrometres and degrees.

use std::fmt;

use calibration::PlatePose;
use quantities::{Angle, Length};
use serde::Serialize;

use crate::rounding::nanometres_within;

/// Last digits of a tilt, as it is told.
const DIGITS_PER_DEG: f64 = 1e4;

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

    /// It in the digits that are told: the piston a nanometre nearer to the middle of its range at most, and tilts in the same direction that
    /// are less by so many of their last digits.
    pub(crate) fn told(&self, (low_um, top_um): (f64, f64), digits: u8) -> Self {
        let is_upper = self.z_um > 0.5 * (low_um + top_um);
        let towards_middle = if is_upper { f64::floor } else { f64::ceil };
        let length_deg = self.tilt_x_deg.hypot(self.tilt_y_deg);
        let share = match length_deg > 0.0 {
            true => (1.0 - f64::from(digits) / (DIGITS_PER_DEG * length_deg)).max(0.0),
            false => 0.0,
        };
        let rounded = |deg: f64| (share * deg * DIGITS_PER_DEG).round() / DIGITS_PER_DEG;
        Self {
            z_um: nanometres_within(self.z_um, towards_middle).um,
            tilt_x_deg: rounded(self.tilt_x_deg),
            tilt_y_deg: rounded(self.tilt_y_deg),
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
