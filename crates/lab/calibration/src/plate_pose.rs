//! Poses of a plate, in f64.

use control_core::{Micrometre, Pose, Radian};
use experiments::Run;

/// Piston (um) and tilts about x and y (rad) of a plate, in f64.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlatePose {
    /// From rest and towards the substrate.
    pub z_um: f64,
    /// Right-handed: z rises along y.
    pub tilt_x_rad: f64,
    /// Right-handed: z falls along x.
    pub tilt_y_rad: f64,
}

impl PlatePose {
    /// The pose that a run along positions asks for so long after its start (s).
    pub fn along(run: &Run, t_s: f64) -> Self {
        let [tilt_x_rad, tilt_y_rad] = run.tilts_at(t_s);
        Self {
            z_um: run.signal.at(t_s),
            tilt_x_rad,
            tilt_y_rad,
        }
    }

    /// How high the plate is above a spot, x and y from its centre in um (um).
    pub fn height_um(&self, [x_um, y_um]: [f64; 2]) -> f64 {
        self.z_um + y_um * self.tilt_x_rad - x_um * self.tilt_y_rad
    }
}

impl From<PlatePose> for Pose {
    fn from(pose: PlatePose) -> Self {
        Self {
            z: Micrometre(pose.z_um as f32),
            tilt_x: Radian(pose.tilt_x_rad as f32),
            tilt_y: Radian(pose.tilt_y_rad as f32),
        }
    }
}

impl From<Pose> for PlatePose {
    fn from(pose: Pose) -> Self {
        Self {
            z_um: pose.z.0.into(),
            tilt_x_rad: pose.tilt_x.0.into(),
            tilt_y_rad: pose.tilt_y.0.into(),
        }
    }
}
