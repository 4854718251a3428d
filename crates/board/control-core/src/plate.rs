//! The stage `plate`: three coordinates of a rigid plate, and the four actuators that carry it.
//!
//! With small angles the plate at actuator `i` is at `z + y_i tilt_x - x_i tilt_y`, its levers being `x_i` and `y_i`. Four
//! actuators have one direction to spare, the warp, which the plate does not follow: in a symmetric mirror two opposite
//! actuators go up and the other two down. No warp holds the heaters' temperatures least apart, so none is used where all
//! four are within their range without one. Where they are not, the smallest warp that brings them back makes every pose
//! possible that any drives can reach (direct allocation, Durham 1993).

use crate::CHANNELS;
use crate::calibration::{Lever, Plate};
use crate::limits::{Limit, Limits};
use crate::units::{Micrometre, Radian};

/// Where the plate is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// Piston: displacement of the centre, from rest and towards the substrate.
    pub z: Micrometre,
    /// Rotation about the x axis: z rises along y.
    pub tilt_x: Radian,
    /// Rotation about the y axis: z falls along x.
    pub tilt_y: Radian,
}

/// The plate between its pose and the positions of its actuators (um).
#[derive(Clone, Debug)]
pub struct PlateInverse {
    levers: [Lever; CHANNELS],
    /// Warp per position of each actuator, 1 / its part; 0 where it has none.
    per_warp: [f32; CHANNELS],
    is_known: bool,
    /// Top of the actuators' range (um).
    top: f32,
    /// What each actuator's position adds to z (um/um) and to the tilts (rad/um).
    shares: [[f32; CHANNELS]; 3],
}

/// Part of the range that rounding takes: some bits of f32.
const ROUNDING: f32 = 1e-6;

impl From<Micrometre> for Pose {
    fn from(z: Micrometre) -> Self {
        Self {
            z,
            ..Self::default()
        }
    }
}

impl PlateInverse {
    /// The inverse of a plate whose actuators all reach up to `top`.
    pub fn new(plate: &Plate, top: Micrometre) -> Self {
        Self {
            levers: plate.levers,
            per_warp: plate.levers.map(|lever| match lever.warp {
                0.0 => 0.0,
                warp => 1.0 / warp,
            }),
            is_known: plate.is_known(),
            top: top.0,
            shares: shares(plate),
        }
    }

    /// Whether the levers are known.
    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// Positions of the actuators (um) at which the plate is at `pose`. A pose out of reach is limited by name: each actuator
    /// goes as far as it can.
    #[inline(always)]
    pub fn positions(&self, pose: &Pose, limits: &mut Limits) -> [f32; CHANNELS] {
        let Pose { z, tilt_x, tilt_y } = *pose;
        let mut positions = [0.0; CHANNELS];
        let mut is_within = true;
        for (position, lever) in positions.iter_mut().zip(&self.levers) {
            *position = z.0 + lever.y.0 * tilt_x.0 - lever.x.0 * tilt_y.0;
            // As bits, what is below zero or no number is above every number.
            is_within &= position.to_bits() <= self.top.to_bits();
        }
        let is_level = tilt_x.0 == 0.0 && tilt_y.0 == 0.0;
        if !is_within || !(self.is_known || is_level) {
            self.limit(&mut positions, is_level, limits);
        }
        positions
    }

    /// The pose in which actuators at `positions` (um) hold the plate.
    pub fn pose(&self, positions: &[f32; CHANNELS]) -> Pose {
        let sum = |shares: &[f32; CHANNELS]| -> f32 {
            let products = shares.iter().zip(positions);
            products.map(|(share, position)| share * position).sum()
        };
        let [z, tilt_x, tilt_y] = &self.shares;
        Pose {
            z: Micrometre(sum(z)),
            tilt_x: Radian(sum(tilt_x)),
            tilt_y: Radian(sum(tilt_y)),
        }
    }

    /// Warps the plate so that all actuators are within their range, as far as a warp does it.
    #[inline(never)]
    fn limit(&self, positions: &mut [f32; CHANNELS], is_level: bool, limits: &mut Limits) {
        if !(self.is_known || is_level) {
            limits.insert(Limit::TiltUnknown);
        }
        if positions.iter().any(|position| position.is_nan()) {
            limits.insert(Limit::NotANumber);
            *positions = [0.0; CHANNELS];
            return;
        }
        if self.is_known {
            let warp = self.warp(positions);
            for (position, lever) in positions.iter_mut().zip(&self.levers) {
                *position += warp * lever.warp;
            }
        }
        // What rounding leaves of a warp that just fits is no limit.
        let slack = ROUNDING * self.top;
        for position in positions {
            if *position < 0.0 {
                if *position < -slack {
                    limits.insert(Limit::PositionLow);
                }
                *position = 0.0;
            } else if *position > self.top {
                if *position > self.top + slack {
                    limits.insert(Limit::PositionHigh);
                }
                *position = self.top;
            }
        }
    }

    /// The warp nearest to none with which all `positions` are within the range; where there is none, the middle of those that
    /// bring them nearest.
    fn warp(&self, positions: &[f32; CHANNELS]) -> f32 {
        let (mut least, mut most) = (f32::NEG_INFINITY, f32::INFINITY);
        for (position, per_warp) in positions.iter().zip(&self.per_warp) {
            let (at_rest, at_top) = (-position * per_warp, (self.top - position) * per_warp);
            let (low, high) = if *per_warp > 0.0 {
                (at_rest, at_top)
            } else if *per_warp < 0.0 {
                (at_top, at_rest)
            } else {
                continue;
            };
            least = if low > least { low } else { least };
            most = if high < most { high } else { most };
        }
        let warp = if least > most {
            0.5 * (least + most)
        } else if least > 0.0 {
            least
        } else if most < 0.0 {
            most
        } else {
            0.0
        };
        if warp.is_finite() { warp } else { 0.0 }
    }
}

/// What each actuator's position adds to z and the tilts: the rows of the matrix that undoes the levers and the warp. Where the
/// levers are unknown the piston is the mean, and there are no tilts.
fn shares(plate: &Plate) -> [[f32; CHANNELS]; 3] {
    let piston = [1.0; CHANNELS];
    let tilt_x = plate.levers.map(|lever| lever.y.0);
    let tilt_y = plate.levers.map(|lever| -lever.x.0);
    let warp = plate.levers.map(|lever| lever.warp);
    if !plate.is_known() {
        return [
            [1.0 / CHANNELS as f32; CHANNELS],
            [0.0; CHANNELS],
            [0.0; CHANNELS],
        ];
    }
    let share = |of: &[f32; CHANNELS], others: [&[f32; CHANNELS]; 3]| {
        let across = across(others);
        let whole: f32 = across.iter().zip(of).map(|(a, b)| a * b).sum();
        across.map(|part| part / whole)
    };
    [
        share(&piston, [&tilt_x, &tilt_y, &warp]),
        share(&tilt_x, [&piston, &tilt_y, &warp]),
        share(&tilt_y, [&piston, &tilt_x, &warp]),
    ]
}

/// The vector at right angles to three others: their generalised cross product.
pub(crate) fn across([a, b, c]: [&[f32; CHANNELS]; 3]) -> [f32; CHANNELS] {
    let minor = |i: usize, j: usize, k: usize| {
        a[i] * (b[j] * c[k] - b[k] * c[j]) - a[j] * (b[i] * c[k] - b[k] * c[i])
            + a[k] * (b[i] * c[j] - b[j] * c[i])
    };
    [
        minor(1, 2, 3),
        -minor(0, 2, 3),
        minor(0, 1, 3),
        -minor(0, 1, 2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TOP_UM: f32 = 170.0;

    /// Levers of a mirror that is no exact square.
    fn plate() -> impl Strategy<Value = Plate> {
        let square = Plate::cross(Micrometre(480.0));
        proptest::array::uniform4((-40.0_f32..40.0, -40.0_f32..40.0, 0.9_f32..1.0)).prop_map(
            move |off| {
                let mut plate = square;
                for (lever, (x, y, warp)) in plate.levers.iter_mut().zip(off) {
                    lever.x.0 += x;
                    lever.y.0 += y;
                    lever.warp *= warp;
                }
                plate
            },
        )
    }

    fn inverse(plate: &Plate) -> PlateInverse {
        PlateInverse::new(plate, Micrometre(TOP_UM))
    }

    fn pose(z: f32, tilt_x: f32, tilt_y: f32) -> Pose {
        Pose {
            z: Micrometre(z),
            tilt_x: Radian(tilt_x),
            tilt_y: Radian(tilt_y),
        }
    }

    /// Whether any positions of the actuators hold the plate there: on a fine grid of warps.
    fn is_reachable(plate: &Plate, pose: &Pose) -> bool {
        (-2000..=2000).any(|step| {
            let warp = step as f32 * TOP_UM / 1000.0;
            plate.levers.iter().all(|lever| {
                let Pose { z, tilt_x, tilt_y } = pose;
                let at = z.0 + lever.y.0 * tilt_x.0 - lever.x.0 * tilt_y.0 + warp * lever.warp;
                (0.0..=TOP_UM).contains(&at)
            })
        })
    }

    proptest! {
        #[test]
        fn whatever_can_be_reached_is_reached_and_the_rest_is_named(
            plate in plate(), z in 0.0_f32..TOP_UM, tilt_x in -0.4_f32..0.4, tilt_y in -0.4_f32..0.4,
        ) {
            let asked = pose(z, tilt_x, tilt_y);
            let inverse = inverse(&plate);
            let mut limits = Limits::NONE;
            let positions = inverse.positions(&asked, &mut limits);
            prop_assert!(positions.iter().all(|at| (0.0..=TOP_UM).contains(at)), "{positions:?}");
            if is_reachable(&plate, &asked) {
                prop_assert_eq!(limits, Limits::NONE);
            }
            if limits == Limits::NONE {
                let held = inverse.pose(&positions);
                // f32 has 24 bits, and tilts are differences of positions over levers of half a millimetre.
                prop_assert!((held.z.0 - z).abs() < 1e-3, "{held:?} for {asked:?}");
                prop_assert!((held.tilt_x.0 - tilt_x).abs() < 2e-6, "{held:?} for {asked:?}");
                prop_assert!((held.tilt_y.0 - tilt_y).abs() < 2e-6, "{held:?} for {asked:?}");
            } else {
                prop_assert!(limits.contains(Limit::PositionLow) || limits.contains(Limit::PositionHigh));
            }
        }

        #[test]
        fn any_bit_pattern_is_answered_within_the_range(plate in plate(), bits: [u32; 3]) {
            let [z, tilt_x, tilt_y] = bits.map(f32::from_bits);
            let mut limits = Limits::NONE;
            let positions = inverse(&plate).positions(&pose(z, tilt_x, tilt_y), &mut limits);
            prop_assert!(positions.iter().all(|at| (0.0..=TOP_UM).contains(at)), "{positions:?}");
        }
    }

    #[test]
    fn a_level_plate_has_all_actuators_where_it_is() {
        let mut limits = Limits::NONE;
        let level = pose(64.25, 0.0, 0.0);
        for plate in [Plate::UNKNOWN, Plate::cross(Micrometre(480.0))] {
            assert_eq!(
                inverse(&plate).positions(&level, &mut limits),
                [64.25; CHANNELS]
            );
            assert_eq!(inverse(&plate).pose(&[64.25; CHANNELS]).z.0, 64.25);
        }
        assert_eq!(limits, Limits::NONE);
    }

    #[test]
    fn a_warp_doubles_the_tilt_near_rest() {
        let plate = Plate::cross(Micrometre(100.0));
        let mut limits = Limits::NONE;
        // 2 z / lever: the two actuators on the axis rest.
        let positions = inverse(&plate).positions(&pose(20.0, 0.4, 0.0), &mut limits);
        assert_eq!(limits, Limits::NONE);
        for (at, expected) in positions.into_iter().zip([0.0, 80.0, 0.0, 0.0]) {
            assert!((at - expected).abs() < 1e-4, "{positions:?}");
        }
        inverse(&plate).positions(&pose(20.0, 0.41, 0.0), &mut limits);
        assert!(limits.contains(Limit::PositionLow));
    }

    #[test]
    fn tilts_of_a_plate_that_is_not_known_are_named() {
        let mut limits = Limits::NONE;
        let positions = inverse(&Plate::UNKNOWN).positions(&pose(60.0, 1e-3, 0.0), &mut limits);
        assert_eq!(positions, [60.0; CHANNELS]);
        assert!(limits.contains(Limit::TiltUnknown));
    }
}
