//! The plane of a plate from a scan of points, by principal components, as the paper's second procedure has it.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Points whose second principal variance is this part of the first one's, or less, lie on a line: a thousandth of its length
/// aside, as a stage's straightness and its coordinates' rounding are.
const LINE: f64 = 1e-6;
/// A plane whose normal has a smaller z stands upright, within 0.06 degrees, and has no height.
const UPRIGHT: f64 = 1e-3;

/// A plate's plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Plane {
    /// Rotation about the x axis, right-handed: z rises along y.
    pub tilt_x_deg: f64,
    /// Rotation about the y axis, right-handed: z falls along x.
    pub tilt_y_deg: f64,
    /// Mean of the points' z.
    pub z_um: f64,
    /// Root mean square distance of the points from the plane.
    pub rms_um: f64,
}

impl Plane {
    /// The plane from which points (x, y, z in um) have the least mean square distance. `None` where they do not span
    /// one: fewer than three, all on a line, or a plane that stands upright.
    pub fn through(points: &[[f64; 3]]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let count = points.len() as f64;
        let vectors = || points.iter().map(|point| Vector3::from(*point));
        let centre = vectors().sum::<Vector3<f64>>() / count;
        let covariance = vectors()
            .map(|point| (point - centre) * (point - centre).transpose())
            .sum::<Matrix3<f64>>()
            / count;
        let components = covariance.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| components.eigenvalues[a].total_cmp(&components.eigenvalues[b]));
        let [least, middle, most] = order.map(|index| components.eigenvalues[index].max(0.0));
        let normal = components.eigenvectors.column(order[0]);
        if !most.is_finite() || middle < LINE * most || normal.z.abs() < UPRIGHT {
            return None;
        }
        let (along_x, along_y) = (-normal.x / normal.z, -normal.y / normal.z);
        Some(Self {
            tilt_x_deg: along_y.atan().to_degrees(),
            tilt_y_deg: -along_x.atan().to_degrees(),
            z_um: centre.z,
            rms_um: least.sqrt(),
        })
    }
}
