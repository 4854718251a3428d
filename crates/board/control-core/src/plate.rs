//! The stage `plate`: three coordinates of a rigid plate, and the four actuators that carry it.
//!
//! With small angles the plate at actuator `i` is at `z + y_i tilt_x - x_i tilt_y`, its levers being `x_i` and `y_i`. Four
//! actuators have one direction to spare, the warp, which the plate does not follow: in a symmetric mirror two opposite
//! actuators go up and the other two down. No warp holds the heaters' temperatures least apart, so none is used where all
//! four are within their range without one. Where they are not, the smallest warp that brings them back makes every pose
//! possible that any drives can reach (direct allocation, Durham 1993).

use core::array;
use core::hint::cold_path;

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
    /// Warp that moves each actuator by a micrometre: 1 / its part in it, 0 where it has none.
    warps_per_um: [f32; CHANNELS],
    /// No reachable pose needs a larger one, and beyond it f32 is too coarse.
    most_warp: f32,
    is_known: bool,
    /// Top of the actuators' range (um).
    top: f32,
    /// To where a warp brings actuators back (um): the ends of the range, to within it by what rounding takes.
    ends: (f32, f32),
    /// Positions below it, as bits, need no look: up to the top, and none where the levers are unknown.
    beyond: u32,
    /// What each actuator's position adds to z (um/um) and to the tilts (rad/um).
    shares: [[f32; CHANNELS]; 3],
}

/// Part of the range that rounding takes: some bits of f32, at four times the range.
const ROUNDING: f32 = 4e-6;
/// A warp moves no actuator further than this many times the range: it brings those back that a tilt takes out of it by as much
/// as the range at most.
const MOST_RANGES: f32 = 4.0;

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
            warps_per_um: plate.levers.map(|lever| inverse_or_0(lever.warp)),
            most_warp: MOST_RANGES * top.0 / largest_part(plate),
            is_known: plate.is_known(),
            top: top.0,
            ends: (ROUNDING * top.0, (1.0 - ROUNDING) * top.0),
            beyond: match plate.is_known() {
                true => top.0.to_bits() + 1,
                false => 0,
            },
            shares: shares(plate),
        }
    }

    /// Whether the levers are known.
    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// Positions of the actuators (um) at which the plate is at `pose`, and what limits them: out of reach each actuator goes as far as it
    /// can.
    #[inline(always)]
    pub fn positions(&self, pose: &Pose) -> ([f32; CHANNELS], Limits) {
        let positions = self.unwarped(pose);
        let Some(warp) = self.needed_warp(&positions) else {
            return (positions, Limits::NONE);
        };
        let warped = array::from_fn(|i| positions[i] + warp * self.levers[i].warp);
        // A pose too far for f32 has actuators out of the range under any warp, and one of unknown levers under none.
        if self.are_within(&warped) {
            return (warped, Limits::NONE);
        }
        // One by one, which leaves the others in registers.
        let mut limits = Limits::NONE;
        let [a, b, c, d] = self.limit_warped(pose, &mut limits);
        ([a, b, c, d], limits)
    }

    /// Positions without a warp (um).
    #[inline(always)]
    fn unwarped(&self, pose: &Pose) -> [f32; CHANNELS] {
        let Pose { z, tilt_x, tilt_y } = *pose;
        let at = |lever: &Lever| z.0 + lever.y.0 * tilt_x.0 - lever.x.0 * tilt_y.0;
        self.levers.each_ref().map(at)
    }

    fn without_levers(&self, pose: &Pose, limits: &mut Limits) -> [f32; CHANNELS] {
        if pose.tilt_x.0 != 0.0 || pose.tilt_y.0 != 0.0 {
            limits.insert(Limit::TiltUnknown);
        }
        self.limit(self.unwarped(pose), limits)
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

    /// The piston's standard deviation where the actuators' positions have these (um), each its own.
    pub fn piston_deviation(&self, deviations: &[f32; CHANNELS]) -> Micrometre {
        let [z, _, _] = &self.shares;
        Micrometre(fpu::sqrt(variance(z, deviations)))
    }

    /// The larger of the tilts' standard deviations where the actuators' positions have these (um), each its own.
    pub fn tilt_deviation(&self, deviations: &[f32; CHANNELS]) -> Radian {
        let [_, tilt_x, tilt_y] = &self.shares;
        let (x, y) = (variance(tilt_x, deviations), variance(tilt_y, deviations));
        Radian(fpu::sqrt(if x > y { x } else { y }))
    }

    #[inline(always)]
    fn are_within(&self, positions: &[f32; CHANNELS]) -> bool {
        positions.iter().all(|position| self.is_within(*position))
    }

    #[inline(always)]
    fn is_within(&self, position: f32) -> bool {
        // As bits, what is below zero or no number is above every number.
        position.to_bits() < self.beyond
    }

    /// The warp nearest to none that brings one of `positions` into the range that needs most; `None` where all are within it.
    #[inline(always)]
    fn needed_warp(&self, positions: &[f32; CHANNELS]) -> Option<f32> {
        let (rest, top) = self.ends;
        let mut most = None;
        for (position, per_um) in positions.iter().zip(&self.warps_per_um) {
            if !self.is_within(*position) {
                cold_path();
                let end = if *position < 0.0 { rest } else { top };
                let needed = (end - position) * per_um;
                if most.is_none_or(|most: f32| needed.abs() > most.abs()) {
                    most = Some(needed);
                }
            }
        }
        most
    }

    /// No warp brings all of them into the range: the one that brings them nearest, and a limit.
    #[cold]
    #[inline(never)]
    fn limit_warped(&self, pose: &Pose, limits: &mut Limits) -> [f32; CHANNELS] {
        if !self.is_known {
            return self.without_levers(pose, limits);
        }
        let mut positions = self.unwarped(pose);
        let (rest, top) = self.ends;
        let (mut least, mut most) = (-self.most_warp, self.most_warp);
        for (position, per_um) in positions.iter().zip(&self.warps_per_um) {
            if *per_um != 0.0 {
                let (to_rest, to_top) = ((rest - position) * per_um, (top - position) * per_um);
                least = least.max(to_rest.min(to_top));
                most = most.min(to_rest.max(to_top));
            }
        }
        let warp = 0.5 * (least + most);
        // No warp brings back what is infinitely far.
        if warp.is_finite() {
            for (position, lever) in positions.iter_mut().zip(&self.levers) {
                *position += warp * lever.warp;
            }
        }
        self.limit(positions, limits)
    }

    /// Each actuator as far as it can, and what limits it.
    #[cold]
    #[inline(never)]
    fn limit(&self, positions: [f32; CHANNELS], limits: &mut Limits) -> [f32; CHANNELS] {
        if positions.iter().any(|position| position.is_nan()) {
            limits.insert(Limit::NotANumber);
            return [0.0; CHANNELS];
        }
        // What rounding leaves of a warp that just fits is no limit.
        let slack = ROUNDING * self.top;
        positions.map(|position| {
            if position < 0.0 {
                if position < -slack {
                    limits.insert(Limit::PositionLow);
                }
                0.0
            } else if position > self.top {
                if position > self.top + slack {
                    limits.insert(Limit::PositionHigh);
                }
                self.top
            } else {
                position
            }
        })
    }
}

/// Variance of a sum of shares of positions that have these standard deviations, each its own.
fn variance(shares: &[f32; CHANNELS], deviations: &[f32; CHANNELS]) -> f32 {
    let parts = shares.iter().zip(deviations);
    parts.map(|(share, um)| share * um * share * um).sum()
}

/// 1 / `number`, 0 where it is none.
fn inverse_or_0(number: f32) -> f32 {
    if number == 0.0 { 0.0 } else { 1.0 / number }
}

/// The largest part that an actuator has in the warp; 1 where the levers are unknown.
fn largest_part(plate: &Plate) -> f32 {
    let parts = plate.levers.iter().map(|lever| lever.warp.abs());
    let largest = parts.fold(0.0, f32::max);
    if largest > 0.0 { largest } else { 1.0 }
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
            let (positions, limits) = inverse.positions(&asked);
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
            let (positions, _) = inverse(&plate).positions(&pose(z, tilt_x, tilt_y));
            prop_assert!(positions.iter().all(|at| (0.0..=TOP_UM).contains(at)), "{positions:?}");
        }
    }

    #[test]
    fn a_level_plate_has_all_actuators_where_it_is() {
        let level = pose(64.25, 0.0, 0.0);
        for plate in [Plate::UNKNOWN, Plate::cross(Micrometre(480.0))] {
            assert_eq!(
                inverse(&plate).positions(&level),
                ([64.25; CHANNELS], Limits::NONE)
            );
            assert_eq!(inverse(&plate).pose(&[64.25; CHANNELS]).z.0, 64.25);
        }
    }

    #[test]
    fn a_warp_doubles_the_tilt_near_rest() {
        let plate = Plate::cross(Micrometre(100.0));
        // 2 z / lever: the two actuators on the axis rest.
        let (positions, limits) = inverse(&plate).positions(&pose(20.0, 0.4, 0.0));
        assert_eq!(limits, Limits::NONE);
        for (at, expected) in positions.into_iter().zip([0.0, 80.0, 0.0, 0.0]) {
            assert!((at - expected).abs() < 1e-4, "{positions:?}");
        }
        let (_, limits) = inverse(&plate).positions(&pose(20.0, 0.41, 0.0));
        assert!(limits.contains(Limit::PositionLow));
    }

    #[test]
    fn tilts_of_a_plate_that_is_not_known_are_named() {
        let (positions, limits) = inverse(&Plate::UNKNOWN).positions(&pose(60.0, 1e-3, 0.0));
        assert_eq!(positions, [60.0; CHANNELS]);
        assert!(limits.contains(Limit::TiltUnknown));
    }
}
