//! Which poses a mirror reaches.

use control_core::CHANNELS;
use control_core::calibration::Plate;

use crate::plate_pose::PlatePose;
use crate::pose::{Cause, Drives, NotHeld, largest};

/// The poses that a plate reaches: those for which a warp takes all four actuators into their range, and which the drives hold at rest,
/// where they are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    plate: Plate,
    /// Ends of the actuators' range (um).
    low_um: f64,
    top_um: f64,
    /// The highest piston of a level plate (um): lower than the actuators' range where the room takes more than they have.
    highest_um: f64,
    drives: Option<Drives>,
}

/// By how much an actuator may be warmer than a pose asks, or less warm, and it is reached all the same (K): some 0.02 um, which turns a
/// plate on levers of 230 um by 0.0023 deg of the 0.005 deg that tilts may be off by (docs/requirements.md), and ten times what rounding to
/// the digits that are told may take. There is no margin: of poses a fiftieth within the edge nearly all are held (`closed-loop`, test
/// `pose`), and one that is missed is limited by name.
const HARDLY_OFF_K: f64 = 0.01;
/// Bisections of a tilt or a piston that is told: to a billionth.
const BISECTIONS: usize = 30;
/// Pistons at which a tilt is tried.
const PISTONS: u32 = 64;

/// How far a pose may be out of reach for its rounding (um): what the core takes for none.
const ROUNDING_UM: f64 = 1e-4;

impl Reach {
    /// What a plate reaches whose actuators go from 0 to `top_um`.
    pub fn new(plate: Plate, top_um: f64) -> Self {
        Self {
            plate,
            low_um: 0.0,
            top_um,
            highest_um: top_um,
            drives: None,
        }
    }

    /// What of it these drives hold at rest. A level plate is taken to be held in the room of the calibration, where its tables end with what the
    /// drives hold; in another one it goes as high as they do.
    pub fn held_by(self, drives: Drives) -> Self {
        let level = |z_um: f64| PlatePose {
            z_um,
            ..PlatePose::default()
        };
        // The room takes so much more there than that of the calibration does.
        let at_home = drives.clone().at_home().farthest_off(&level(self.top_um));
        let borne_k = HARDLY_OFF_K.max(at_home.k);
        let is_held = |z_um: f64| {
            let off = drives.farthest_off(&level(z_um));
            off.cause == Cause::KeptWarm || off.k <= borne_k
        };
        Self {
            highest_um: largest(self.top_um, BISECTIONS, is_held),
            drives: Some(drives),
            ..self
        }
    }

    /// The same whatever the drives hold.
    pub fn by_range(&self) -> Self {
        Self {
            highest_um: self.top_um,
            drives: None,
            ..self.clone()
        }
    }

    /// What it reaches where its surroundings alone hold the actuators at `low_um`, and heaters cannot cool.
    pub fn above(self, low_um: f64) -> Self {
        Self {
            low_um: low_um.clamp(0.0, self.top_um),
            ..self
        }
    }

    /// With what is hardly beyond it, so far (um): what a board knows of its room is never the same twice.
    pub fn bearing(self, um: f64) -> Self {
        Self {
            low_um: (self.low_um - um).max(0.0),
            highest_um: (self.highest_um + um).min(self.top_um),
            drives: self.drives.map(|drives| drives.bearing(um)),
            ..self
        }
    }

    /// How far its ends may be from where they are told to be, for what is not known of the room (um, standard deviation); `None` where no room
    /// is compensated.
    pub fn ends_deviation_um(&self) -> Option<f64> {
        self.drives.as_ref()?.ends_deviation_um()
    }

    /// From the lowest to the highest piston of a level plate (um).
    pub fn level_um(&self) -> (f64, f64) {
        (self.low_um, self.highest_um)
    }

    /// Whether the levers are known, and with them any tilt.
    pub fn knows_tilts(&self) -> bool {
        self.plate.is_known()
    }

    /// Whether `pose` is reached.
    pub fn contains(&self, pose: &PlatePose) -> bool {
        self.is_in_range(pose) && self.not_held(pose).is_none()
    }

    /// Whether the actuators' range has `pose`, whatever the drives hold.
    fn is_in_range(&self, pose: &PlatePose) -> bool {
        (self.low_um..=self.highest_um).contains(&pose.z_um) && self.share(pose) == 1.0
    }

    /// The actuator that the drives take to where `pose` has it by least, if any.
    pub fn not_held(&self, pose: &PlatePose) -> Option<NotHeld> {
        let borne_k = self.drives.as_ref().map_or(0.0, Drives::borne_k);
        let farthest = self.farthest_off(pose)?;
        (farthest.k > HARDLY_OFF_K + borne_k).then_some(farthest)
    }

    /// The actuator that is off by most at `pose`, or nearest to it; `None` where the drives hold whatever the range has, and of a level plate.
    fn farthest_off(&self, pose: &PlatePose) -> Option<NotHeld> {
        let is_level = pose.tilt_x_rad == 0.0 && pose.tilt_y_rad == 0.0;
        let drives = self.drives.as_ref();
        let drives = drives.filter(|drives| drives.may_hold_less() && !is_level)?;
        Some(drives.farthest_off(pose))
    }

    /// Whether the drives hold a pose within the range, to the last digit.
    fn is_held(&self, pose: &PlatePose) -> bool {
        let farthest = self.farthest_off(pose);
        farthest.is_none_or(|farthest| farthest.k <= 0.0)
    }

    /// The nearest pose with the same piston, or the end of the range that is nearer to it, and tilts in the same direction.
    pub fn nearest(&self, pose: &PlatePose) -> PlatePose {
        if self.contains(pose) {
            return *pose;
        }
        let level = PlatePose {
            z_um: pose.z_um.clamp(self.low_um, self.highest_um),
            ..*pose
        };
        let tilted = |share: f64| PlatePose {
            tilt_x_rad: share * pose.tilt_x_rad,
            tilt_y_rad: share * pose.tilt_y_rad,
            ..level
        };
        tilted(self.largest_held(self.share(&level), tilted))
    }

    /// From the lowest to the highest piston (um) at which these tilts are reached, if there is any.
    pub fn pistons_um(&self, tilt_x_rad: f64, tilt_y_rad: f64) -> Option<(f64, f64)> {
        let tilted = self.tilted_um(tilt_x_rad, tilt_y_rad);
        let (low_um, high_um) = self.interval(tilted, [1.0; CHANNELS])?;
        let high_um = high_um.min(self.highest_um);
        if high_um < low_um {
            return None;
        }
        let at = |z_um: f64| PlatePose {
            z_um,
            tilt_x_rad,
            tilt_y_rad,
        };
        if self.farthest_off(&at(low_um)).is_none() {
            return Some((low_um, high_um));
        }
        let off_k = |z_um| self.farthest_off(&at(z_um)).map_or(0.0, |off| off.k);
        let best_um = least_of(off_k, (low_um, high_um));
        let is_held = |z_um| self.is_held(&at(z_um));
        is_held(best_um).then(|| {
            let down_um = largest(best_um - low_um, BISECTIONS, |um| is_held(best_um - um));
            let up_um = largest(high_um - best_um, BISECTIONS, |um| is_held(best_um + um));
            (best_um - down_um, best_um + up_um)
        })
    }

    /// The largest tilt (rad) that is reached at a piston, where the tilts about x and y are in the ratio of these two.
    pub fn largest_tilt_rad(&self, z_um: f64, (along_x, along_y): (f64, f64)) -> f64 {
        let length = along_x.hypot(along_y);
        let per_rad = (along_x / length, along_y / length);
        let step = self.tilted_um(per_rad.0, per_rad.1);
        let most = self
            .interval([z_um; CHANNELS], step)
            .map_or(0.0, |(_, most)| most.max(0.0));
        self.largest_held(most, |rad| PlatePose {
            z_um,
            tilt_x_rad: rad * per_rad.0,
            tilt_y_rad: rad * per_rad.1,
        })
    }

    /// The largest tilt up to `most` that the drives hold.
    fn largest_held(&self, most: f64, tilted: impl Fn(f64) -> PlatePose) -> f64 {
        largest(most, BISECTIONS, |tilt| self.is_held(&tilted(tilt)))
    }

    /// The part of its tilts that a pose can have, all of them at most.
    fn share(&self, pose: &PlatePose) -> f64 {
        let tilted = self.tilted_um(pose.tilt_x_rad, pose.tilt_y_rad);
        if tilted == [0.0; CHANNELS] {
            return 1.0;
        }
        let largest_um = tilted.into_iter().map(f64::abs).fold(0.0, f64::max);
        let rounding = ROUNDING_UM / largest_um;
        self.interval([pose.z_um; CHANNELS], tilted)
            .map_or(0.0, |(_, most)| (most + rounding).clamp(0.0, 1.0))
    }

    /// How much nearer to the substrate than the centre each actuator is at these tilts (um).
    fn tilted_um(&self, tilt_x_rad: f64, tilt_y_rad: f64) -> [f64; CHANNELS] {
        let levers = self.plate.levers;
        levers.map(|lever| f64::from(lever.y.0) * tilt_x_rad - f64::from(lever.x.0) * tilt_y_rad)
    }

    /// The numbers v for which some warp takes all `start + v step` (um) into the range. A warp is bounded from below and
    /// above by each actuator; eliminating it (Fourier and Motzkin) leaves one inequality for each pair of bounds.
    fn interval(&self, start: [f64; CHANNELS], step: [f64; CHANNELS]) -> Option<(f64, f64)> {
        // A bound is its value at v = 0 and what it changes by with v.
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        let mut inequalities = Vec::new();
        for ((lever, start), step) in self.plate.levers.iter().zip(start).zip(step) {
            let warp = f64::from(lever.warp);
            if warp == 0.0 {
                inequalities.extend([(step, self.top_um - start), (-step, start - self.low_um)]);
                continue;
            }
            let at_low = ((self.low_um - start) / warp, -step / warp);
            let at_top = ((self.top_um - start) / warp, -step / warp);
            let (low, high) = if warp > 0.0 {
                (at_low, at_top)
            } else {
                (at_top, at_low)
            };
            lower.push(low);
            upper.push(high);
        }
        for low in &lower {
            inequalities.extend(upper.iter().map(|high| (low.1 - high.1, high.0 - low.0)));
        }
        // Each says: slope v <= room.
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for (slope, room) in inequalities {
            if slope > 0.0 {
                most = most.min(room / slope);
            } else if slope < 0.0 {
                least = least.max(room / slope);
            } else if room < 0.0 {
                return None;
            }
        }
        // A zero is one without a sign.
        (least <= most).then_some((least + 0.0, most + 0.0))
    }
}

/// Where a function of one piston is least: next to the best of some, of a function that has one valley there.
fn least_of(of: impl Fn(f64) -> f64, (low_um, high_um): (f64, f64)) -> f64 {
    let step_um = (high_um - low_um) / f64::from(PISTONS);
    let tried = (0..=PISTONS).map(|step| low_um + f64::from(step) * step_um);
    let best_um = tried
        .min_by(|a, b| of(*a).total_cmp(&of(*b)))
        .unwrap_or(low_um);
    let (mut low_um, mut high_um) = (
        (best_um - step_um).max(low_um),
        (best_um + step_um).min(high_um),
    );
    for _ in 0..BISECTIONS {
        // A third from either end is left out, whichever is worse.
        let third_um = (high_um - low_um) / 3.0;
        match of(low_um + third_um) < of(high_um - third_um) {
            true => high_um -= third_um,
            false => low_um += third_um,
        }
    }
    0.5 * (low_um + high_um)
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::{Limits, Micrometre, PlateInverse, Pose};
    use proptest::prelude::*;

    const TOP_UM: f64 = 170.0;

    fn plate() -> impl Strategy<Value = Plate> {
        proptest::array::uniform4((-40.0_f32..40.0, -40.0_f32..40.0, 0.9_f32..1.0)).prop_map(
            |off| {
                let mut plate = Plate::cross(Micrometre(480.0));
                for (lever, (x, y, warp)) in plate.levers.iter_mut().zip(off) {
                    lever.x.0 += x;
                    lever.y.0 += y;
                    lever.warp *= warp;
                }
                plate
            },
        )
    }

    /// What the core that drives the board names.
    fn limits(plate: &Plate, pose: &PlatePose) -> Limits {
        let inverse = PlateInverse::new(plate, Micrometre(TOP_UM as f32));
        inverse.positions(&Pose::from(*pose)).1
    }

    proptest! {
        /// Two ways to the same answer: the tool's inequalities, and the core's warp.
        #[test]
        fn the_core_reaches_what_is_said_to_be_reached(
            plate in plate(), z_um in -20.0..190.0, tilt_x_rad in -0.5..0.5, tilt_y_rad in -0.5..0.5,
        ) {
            let reach = Reach::new(plate, TOP_UM);
            let asked = PlatePose { z_um, tilt_x_rad, tilt_y_rad };
            let nearest = reach.nearest(&asked);
            // A hair within: the core's f32 is good to 1e-5 um.
            let within = |share: f64| PlatePose {
                tilt_x_rad: share * nearest.tilt_x_rad,
                tilt_y_rad: share * nearest.tilt_y_rad,
                ..nearest
            };
            prop_assert_eq!(limits(&plate, &within(1.0 - 1e-4)), Limits::NONE);
            prop_assert!(reach.contains(&within(1.0 - 1e-4)));
            if reach.contains(&asked) {
                prop_assert_eq!(nearest, asked);
            } else if (0.0..=TOP_UM).contains(&z_um) && nearest.tilt_x_rad.hypot(nearest.tilt_y_rad) > 1e-2 {
                // 5 nm and more beyond, where the core lets 0.7 nm pass for rounding.
                prop_assert_ne!(limits(&plate, &within(1.001)), Limits::NONE);
            }
        }

        #[test]
        fn pistons_and_tilts_tell_the_same(plate in plate(), z_um in 1.0..169.0, angle in 0.0..6.3_f64) {
            let reach = Reach::new(plate, TOP_UM);
            let direction = (angle.cos(), angle.sin());
            let most = reach.largest_tilt_rad(z_um, direction);
            let at = |share: f64| {
                reach.pistons_um(share * most * direction.0, share * most * direction.1)
            };
            let (low, high) = at(0.9999).expect("reached");
            prop_assert!(low <= z_um && z_um <= high);
            let beyond = at(1.001).is_some_and(|(low, high)| low <= z_um && z_um <= high);
            prop_assert!(!beyond);
        }
    }

    proptest! {
        /// A plate whose actuators begin higher is one of a shorter range that is held higher.
        #[test]
        fn surroundings_that_hold_the_plate_take_its_lower_end(
            plate in plate(), low_um in 0.0..60.0, z_um in 0.0..170.0, angle in 0.0..6.3_f64,
        ) {
            let warm = Reach::new(plate, TOP_UM).above(low_um);
            let shorter = Reach::new(plate, TOP_UM - low_um);
            let direction = (angle.cos(), angle.sin());
            let most = warm.largest_tilt_rad(z_um, direction);
            // Rounding of positions over a lever.
            prop_assert!((most - shorter.largest_tilt_rad(z_um - low_um, direction)).abs() < 1e-9);
            let asked = PlatePose { z_um, tilt_x_rad: 0.01, tilt_y_rad: 0.0 };
            prop_assert!(warm.nearest(&asked).z_um >= low_um);
            prop_assert!(!warm.contains(&asked) || Reach::new(plate, TOP_UM).contains(&asked));
        }
    }

    #[test]
    fn a_square_plate_tilts_by_half_its_range_over_a_lever() {
        let reach = Reach::new(Plate::cross(Micrometre(500.0)), TOP_UM);
        let most = reach.largest_tilt_rad(85.0, (1.0, 0.0));
        assert!((most - 85.0 / 500.0).abs() < 1e-9, "{most}");
        // Near rest a warp makes twice the tilt of the piston's height over the lever.
        let most = reach.largest_tilt_rad(20.0, (0.0, 1.0));
        assert!((most - 40.0 / 500.0).abs() < 1e-9, "{most}");
        assert_eq!(reach.pistons_um(0.0, 0.0), Some((0.0, TOP_UM)));
        assert_eq!(reach.pistons_um(0.2, 0.0), None);
    }
}
