//! The pose of a plate from its height under three spots of a displacement sensor or more.

use nalgebra::{Matrix3, Vector3};

use super::point::PoseError;
use crate::plate_pose::PlatePose;

/// Spots whose triangle is flatter than this part of its length lie on a line: a tilt across it would count some twenty times a reading's
/// error.
const FLATTEST: f64 = 0.05;
/// A rigid plate leaves no more than this of its heights (um, root mean square): five times what a sensor's noise and a spot that is
/// placed to a few micrometres leave at a tilt of a degree.
const RIGID_UM: f64 = 0.5;

/// A plate that tilts along the line between two spots by less than this in all poses does not tilt (rad): 0.05 deg, where poses are asked for
/// with a degree and more. Over 100 um it is 0.09 um, some times a reading's noise.
const LEVEL_RAD: f64 = 8.7e-4;

/// Heights above one spot, from rest there, in the order in which poses were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct SpotHeights {
    /// From the plate's centre (um).
    pub at_um: [f64; 2],
    /// Towards the substrate (um).
    pub z_um: Vec<f64>,
}

/// The poses that heights above spots tell, by least squares: z + y tilt_x - x tilt_y at each.
///
/// # Errors
/// Where spots are fewer than three or lie on a line, or the plate is not rigid under them.
pub fn poses_over_spots(spots: &[SpotHeights]) -> Result<Vec<PlatePose>, PoseError> {
    let row = |spot: &SpotHeights| Vector3::new(1.0, spot.at_um[1], -spot.at_um[0]);
    let normal: Matrix3<f64> = spots.iter().map(|it| row(it) * row(it).transpose()).sum();
    let inverse = normal
        .try_inverse()
        .filter(|_| spots.len() >= 3 && !are_on_a_line(spots.iter().map(|spot| spot.at_um)))
        .ok_or(PoseError::SpotsOnALine)?;
    let count = spots.iter().map(|spot| spot.z_um.len()).min().unwrap_or(0);
    let mut squares = 0.0;
    let mut poses = Vec::with_capacity(count);
    for pose in 0..count {
        let heights = spots.iter().map(|spot| row(spot) * spot.z_um[pose]);
        let found = inverse * heights.sum::<Vector3<f64>>();
        squares += spots
            .iter()
            .map(|spot| (row(spot).dot(&found) - spot.z_um[pose]).powi(2))
            .sum::<f64>();
        poses.push(PlatePose {
            z_um: found.x,
            tilt_x_rad: found.y,
            tilt_y_rad: found.z,
        });
    }
    // Three heights lie on a plane whatever they are.
    let spare = ((spots.len() - 3) * count).max(1) as f64;
    let left_um = (squares / spare).sqrt();
    match left_um <= RIGID_UM {
        true => Ok(poses),
        false => Err(PoseError::NotRigid { left_um }),
    }
}

/// Whether no two spots are as high as each other in all poses, of which some tilt the plate along any line.
///
/// # Errors
/// [`PoseError::SameHeights`] with the first two that are.
pub fn check_moved(spots: &[SpotHeights]) -> Result<(), PoseError> {
    let are_same = |a: &SpotHeights, b: &SpotHeights| {
        let apart_um = (a.at_um[0] - b.at_um[0]).hypot(a.at_um[1] - b.at_um[1]);
        let mut heights = a.z_um.iter().zip(&b.z_um);
        heights.all(|(a, b)| (a - b).abs() < LEVEL_RAD * apart_um)
    };
    let pairs = (0..spots.len()).flat_map(|i| (i + 1..spots.len()).map(move |j| (i, j)));
    let mut same = pairs.filter(|&(i, j)| are_same(&spots[i], &spots[j]));
    same.next().map_or(Ok(()), |(i, j)| {
        Err(PoseError::SameHeights {
            first: i + 1,
            second: j + 1,
        })
    })
}

/// Whether spots, x and y from the plate's centre in um, are none or all lie next to the line through the two that are farthest apart, so that
/// heights above them tell no pose.
pub fn are_on_a_line(spots_um: impl Iterator<Item = [f64; 2]> + Clone) -> bool {
    let apart = |a: [f64; 2], b: [f64; 2]| [b[0] - a[0], b[1] - a[1]];
    let pairs = spots_um
        .clone()
        .flat_map(|a| spots_um.clone().map(move |b| (a, apart(a, b))));
    let longest = pairs.max_by(|(_, a), (_, b)| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    let Some((from, [x, y])) = longest else {
        return true;
    };
    let length = x.hypot(y);
    let across = |spot: [f64; 2]| {
        let [to_x, to_y] = apart(from, spot);
        ((x * to_y - y * to_x) / length).abs()
    };
    let widest = spots_um.map(across).fold(0.0, f64::max);
    // Not so for NaN, where all are one spot.
    let is_wide = widest > FLATTEST * length;
    !is_wide
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heights(at_um: [f64; 2], poses: &[PlatePose]) -> SpotHeights {
        let height =
            |pose: &PlatePose| pose.z_um + at_um[1] * pose.tilt_x_rad - at_um[0] * pose.tilt_y_rad;
        SpotHeights {
            at_um,
            z_um: poses.iter().map(height).collect(),
        }
    }

    const POSES: [PlatePose; 2] = [
        PlatePose {
            z_um: 60.0,
            tilt_x_rad: 1e-3,
            tilt_y_rad: -2e-3,
        },
        PlatePose {
            z_um: 90.0,
            tilt_x_rad: 0.0,
            tilt_y_rad: 5e-3,
        },
    ];

    #[test]
    fn heights_over_spots_tell_the_pose_wherever_they_are() {
        let spots = [[100.0, 30.0], [-80.0, 60.0], [10.0, -90.0], [90.0, 90.0]];
        for count in [3, 4] {
            let read: Vec<_> = spots[..count]
                .iter()
                .map(|at| heights(*at, &POSES))
                .collect();
            for (found, pose) in poses_over_spots(&read).expect("a plate").iter().zip(&POSES) {
                assert!((found.z_um - pose.z_um).abs() < 1e-9, "{found:?}");
                assert!(
                    (found.tilt_x_rad - pose.tilt_x_rad).abs() < 1e-12,
                    "{found:?}"
                );
                assert!(
                    (found.tilt_y_rad - pose.tilt_y_rad).abs() < 1e-12,
                    "{found:?}"
                );
            }
        }
    }

    #[test]
    fn a_spot_that_was_not_moved_is_told() {
        let mut read: Vec<_> = [[100.0, 30.0], [-80.0, 60.0], [10.0, -90.0]]
            .map(|at| heights(at, &POSES))
            .into();
        // 30 nm apart, which is noise.
        read[2].z_um = read[0].z_um.iter().map(|um| um + 0.03).collect();
        let (first, second) = (1, 3);
        let refused = PoseError::SameHeights { first, second };
        assert_eq!(check_moved(&read), Err(refused));
        read.pop();
        assert_eq!(check_moved(&read), Ok(()));
    }

    #[test]
    fn spots_on_a_line_and_a_plate_that_bends_are_refused() {
        let on = |spots: &[[f64; 2]]| {
            let read: Vec<_> = spots.iter().map(|at| heights(*at, &POSES)).collect();
            poses_over_spots(&read)
        };
        for spots in [
            &[[0.0, 0.0], [50.0, 50.0]][..],
            &[[0.0, 0.0], [50.0, 50.0], [100.0, 101.0]],
            &[[7.0, 7.0]; 3],
            &[],
        ] {
            assert_eq!(on(spots), Err(PoseError::SpotsOnALine));
        }
        let corners = [[90.0, 90.0], [-90.0, 90.0], [-90.0, -90.0], [90.0, -90.0]];
        let mut bent = corners.map(|at| heights(at, &POSES));
        bent[0].z_um[1] += 4.0;
        assert!(matches!(
            poses_over_spots(&bent),
            Err(PoseError::NotRigid { .. })
        ));
    }
}
