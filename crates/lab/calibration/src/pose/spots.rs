//! The pose of a plate from its height under three spots of a displacement sensor or more.

use measurement::median;
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

/// The line through heights of a level plate near rest begins under all spots where hysteresis holds the plate, on four virtual mirrors within
/// 0.27 um of each other. Twice that and more below the highest of them is rest that was read too high (um).
const BEGINS_UM: f64 = 0.6;

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

/// Whether what was read under each spot begins at rest: a sensor whose range begins above it reads the range's end for rest, and all other
/// heights that much too low. `asked` are the poses, which without a level plate at three heights tell nothing of it.
///
/// # Errors
/// [`PoseError::Begins`] with the spot that begins lowest.
pub fn check_from_rest(spots: &[SpotHeights], asked: &[PlatePose]) -> Result<(), PoseError> {
    let is_level = |pose: &&PlatePose| pose.tilt_x_rad == 0.0 && pose.tilt_y_rad == 0.0;
    let mut level_um: Vec<f64> = asked.iter().filter(is_level).map(|it| it.z_um).collect();
    level_um.sort_by(f64::total_cmp);
    level_um.dedup();
    // The lowest may be below the end of the range itself.
    let [_, low_um, high_um, ..] = level_um[..] else {
        return Ok(());
    };
    let begins_um = |spot: &SpotHeights| {
        let at = |level_um: f64| {
            let poses = asked.iter().zip(&spot.z_um);
            let read = poses.filter(|(pose, _)| is_level(pose) && pose.z_um == level_um);
            median(read.map(|(_, um)| *um).collect())
        };
        let (low, high) = (at(low_um), at(high_um));
        low - (high - low) * low_um / (high_um - low_um)
    };
    let begins: Vec<f64> = spots.iter().map(begins_um).collect();
    let highest_um = begins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = begins.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
    match lowest {
        Some((spot, um)) if highest_um - um > BEGINS_UM => Err(PoseError::Begins {
            spot: spot + 1,
            below_um: highest_um - um,
        }),
        _ => Ok(()),
    }
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
    fn a_range_that_begins_above_rest_is_told() {
        let level = |z_um| PlatePose {
            z_um,
            ..PlatePose::default()
        };
        let asked = [80.0, 6.0, 3.0, 12.0, 12.0, 25.0].map(level);
        let spots = [[-180.0, -150.0], [190.0, -140.0], [10.0, 200.0]];
        // A plate that tilts by 8 % of its piston, off its rest by what hysteresis holds.
        let plate = |pose: &PlatePose| PlatePose {
            z_um: pose.z_um - 0.3,
            tilt_x_rad: 0.08 * pose.z_um / 200.0,
            ..*pose
        };
        let mut read = spots.map(|at| heights(at, &asked.each_ref().map(plate)));
        assert_eq!(check_from_rest(&read, &asked), Ok(()));
        for end_um in [1.5, 5.0] {
            read[2].z_um = read[2]
                .z_um
                .iter()
                .map(|um| um.max(end_um) - end_um)
                .collect();
            let found = check_from_rest(&read, &asked);
            assert!(
                matches!(found, Err(PoseError::Begins { spot: 3, below_um }) if below_um > 0.6 * end_um),
                "{found:?}"
            );
        }
        assert_eq!(check_from_rest(&read, &asked[..2]), Ok(()));
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
