//! Which poses tell a plate apart from others, and which plate a mirror can have.
//!
//! Poses in another unit, of another mirror, or above spots that were mixed up are followed by some plate as well, and mostly exactly.

use std::ops::RangeInclusive;

use control_core::calibration::{Lever, Plate};
use nalgebra::{Matrix2, Vector2};

use super::fit::Found;
use super::point::{PoseError, PosePoint};

/// Of the range: the highest pose must be beyond this, or the shapes above would be guessed.
const HIGHEST: f64 = 0.5;
/// Of the tilts about one axis, by their root mean square: those across it must be this part, or they tell one lever only.
const ACROSS: f64 = 0.1;
/// Distances from the plate's centre at which actuators act (um): MEMS mirrors are a tenth of a millimetre to some millimetres wide, and
/// degrees taken for radians are 57 times as far.
const DISTANCES_UM: RangeInclusive<f32> = 50.0..=5e3;
/// The least part of a warp that an actuator has, of one that has the most: on a square all have the same, and two spots of three that were
/// mixed up leave 0.36.
const LEAST_WARP: f32 = 0.5;
/// Of the range: so far poses may put a level plate from where a calibration has it that was tried. It is what 4 K of the room are worth.
const APART: f64 = 0.05;

/// Whether poses reach high enough, and tilt about both axes.
pub(super) fn check_asked(points: &[PosePoint], top_um: f64) -> Result<(), PoseError> {
    let rests = || points.iter().filter(|point| point.is_rest());
    let highest_um = rests().map(|it| it.asked.z_um).fold(0.0, f64::max);
    if highest_um < HIGHEST * top_um {
        return Err(PoseError::TooLow { highest_um, top_um });
    }
    let mut squares = Matrix2::zeros();
    for point in rests() {
        let tilts = Vector2::new(point.asked.tilt_x_rad, point.asked.tilt_y_rad);
        squares += tilts * tilts.transpose();
    }
    let along = squares.symmetric_eigenvalues();
    // Not so for zero.
    match along.min() > ACROSS * ACROSS * along.max() {
        true => Ok(()),
        false => Err(PoseError::OneAxis),
    }
}

/// Whether the actuators carry a plate as those of a mirror do.
pub(super) fn check_plate(plate: &Plate) -> Result<(), PoseError> {
    for (i, Lever { x, y, warp }) in plate.levers.iter().enumerate() {
        let um = x.0.hypot(y.0);
        if !DISTANCES_UM.contains(&um) {
            return Err(PoseError::Lever {
                actuator: i + 1,
                um: um.into(),
            });
        }
        if warp.abs() < LEAST_WARP {
            return Err(PoseError::Lopsided(i + 1));
        }
    }
    Ok(())
}

/// Whether a level plate is where the calibration has it, so far as it was tried.
pub(super) fn check_piston(
    found: &Found,
    top_um: f64,
    places: &[f64],
    tried_um: f64,
) -> Result<(), PoseError> {
    let apart = |place: &f64| {
        let had_um = place * top_um;
        (found.piston_um(*place, top_um), had_um)
    };
    let far = |(found_um, had_um): &(f64, f64)| {
        *had_um <= tried_um && (found_um - had_um).abs() > APART * top_um
    };
    match places.iter().map(apart).find(far) {
        Some((found_um, had_um)) => Err(PoseError::OtherPiston { found_um, had_um }),
        None => Ok(()),
    }
}
