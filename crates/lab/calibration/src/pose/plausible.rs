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

/// Whether the actuators carry a plate as those of a mirror do, and follow each other around it as they did `before`: two of
/// three spots that were exchanged reflect a plate, whatever their triangle.
pub(super) fn check_plate(plate: &Plate, before: &Plate) -> Result<(), PoseError> {
    if around(plate) * around(before) < 0.0 {
        return Err(PoseError::Reflected);
    }
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

/// The area that the actuators go around one after the other (um2): above 0 from x towards y.
fn around(plate: &Plate) -> f32 {
    let [first, second, third, fourth] = plate.levers.map(|lever| [lever.x.0, lever.y.0]);
    let [across, along] =
        [(first, third), (second, fourth)].map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
    0.5 * (across[0] * along[1] - across[1] * along[0])
}

/// By which angle the actuators are turned around the plate against where they were `before` (rad): above 0 from x towards y.
pub(super) fn turned_rad(plate: &Plate, before: &Plate) -> f64 {
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (now, then) in plate.levers.iter().zip(&before.levers) {
        sine += then.x.0 * now.y.0 - then.y.0 * now.x.0;
        cosine += then.x.0 * now.x.0 + then.y.0 * now.y.0;
    }
    f64::from(sine).atan2(cosine.into())
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

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Micrometre;

    const BEFORE: Plate = Plate::cross(Micrometre(500.0));

    /// What heights above three spots make of a plate whose `order` tells where each was read.
    fn mixed(spots: [[f32; 2]; 3], order: [usize; 3]) -> Plate {
        let [a, b, c] = spots;
        let mut plate = Plate::cross(Micrometre(225.0));
        for lever in &mut plate.levers {
            let area = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| {
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            };
            let at = [lever.x.0, lever.y.0];
            let parts = [area(at, b, c), area(a, at, c), area(a, b, at)];
            let place = |axis: usize| {
                let products = parts.iter().zip(order);
                let sum: f32 = products.map(|(part, was)| part * spots[was][axis]).sum();
                Micrometre(sum / area(a, b, c))
            };
            (lever.x, lever.y) = (place(0), place(1));
        }
        plate
    }

    #[test]
    fn two_spots_that_were_exchanged_are_refused_and_three_turn_the_plate() {
        for spots in [
            [[200.0, 0.0], [-100.0, 173.0], [-100.0, -173.0]],
            [[-150.0, -150.0], [200.0, -100.0], [0.0, 200.0]],
        ] {
            let right = mixed(spots, [0, 1, 2]);
            assert_eq!(check_plate(&right, &BEFORE), Ok(()));
            assert!(turned_rad(&right, &BEFORE).abs() < 1e-3);
            for exchanged in [[1, 0, 2], [2, 1, 0], [0, 2, 1]] {
                let plate = mixed(spots, exchanged);
                assert_eq!(check_plate(&plate, &BEFORE), Err(PoseError::Reflected));
            }
            for ring in [[1, 2, 0], [2, 0, 1]] {
                let turned = turned_rad(&mixed(spots, ring), &BEFORE).abs();
                assert!(turned > 1.0, "{turned}");
            }
        }
    }
}
