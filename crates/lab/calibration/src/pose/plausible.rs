//! Which poses tell a plate apart from others, and which plate a mirror can have.
//!
//! Poses in another unit, of another mirror, or above spots that were mixed up are followed by some plate as well, and mostly exactly.

use std::ops::RangeInclusive;

use control_core::calibration::{Lever, Plate};
use nalgebra::{Matrix2, Vector2};

use super::fit::{Found, ZERO_TILT_UM};
use super::point::{PoseError, PosePoint};
use crate::plate_pose::PlatePose;

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

/// In standard deviations of what hysteresis, or what is left of tilts, makes of a rest: one that is tilted by more is none, or the
/// instrument's zero has moved since.
const MOST_ZEROS: f64 = 5.0;
const CHANCE: f64 = 3.0;
/// Level poses up to here, as a part of the range, tell where a plate rests that goes on straight: each actuator's curve does so near rest.
const LOW: f64 = 0.1;

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

/// Whether the instrument's zero is the plate at rest: the two lowest level poses, gone on with straight, say how a plate that is not moved is
/// tilted. `left_um`: root mean square of what is left of the tilts.
pub(super) fn check_rest(
    points: &[PosePoint],
    top_um: f64,
    lever_um: f64,
    left_um: f64,
) -> Result<(), PoseError> {
    let is_level = |asked: &PlatePose| asked.tilt_x_rad == 0.0 && asked.tilt_y_rad == 0.0;
    let is_low = |asked: &PlatePose| asked.z_um > 0.0 && asked.z_um <= LOW * top_um;
    let mut low: Vec<_> = points
        .iter()
        .filter(|point| point.is_rest() && is_level(&point.asked) && is_low(&point.asked))
        .filter_map(|point| Some((point.asked.z_um, point.reached?)))
        .collect();
    low.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let [(low_um, low), (high_um, high), ..] = low[..] else {
        return Ok(());
    };
    let at_rest = |low: f64, high: f64| low - (high - low) * low_um / (high_um - low_um);
    let tilt_rad = f64::hypot(
        at_rest(low.tilt_x_rad, high.tilt_x_rad),
        at_rest(low.tilt_y_rad, high.tilt_y_rad),
    );
    let scatter = f64::hypot(high_um, low_um) / (high_um - low_um);
    let most_um = (MOST_ZEROS * ZERO_TILT_UM).max(CHANCE * scatter * left_um);
    match tilt_rad * lever_um > most_um {
        true => Err(PoseError::OtherRest {
            tilt_deg: tilt_rad.to_degrees(),
        }),
        false => Ok(()),
    }
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
