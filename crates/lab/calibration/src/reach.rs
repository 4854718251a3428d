//! Which poses a mirror reaches.

use control_core::calibration::Plate;
use control_core::{CHANNELS, Micrometre, Pose, Radian};

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

/// The poses that a plate reaches: those for which a warp takes all four actuators into their range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    plate: Plate,
    /// Ends of the actuators' range (um).
    low_um: f64,
    top_um: f64,
}

/// How far a pose may be out of reach for its rounding (um): what the core takes for none.
const ROUNDING_UM: f64 = 1e-4;

impl Reach {
    /// What a plate reaches whose actuators go from 0 to `top_um`.
    pub fn new(plate: Plate, top_um: f64) -> Self {
        Self {
            plate,
            low_um: 0.0,
            top_um,
        }
    }

    /// What it reaches where its surroundings alone hold the actuators at `low_um`, and heaters cannot cool.
    pub fn above(self, low_um: f64) -> Self {
        Self {
            low_um: low_um.clamp(0.0, self.top_um),
            ..self
        }
    }

    /// From the lowest to the highest piston of a level plate (um).
    pub fn level_um(&self) -> (f64, f64) {
        (self.low_um, self.top_um)
    }

    /// Whether the levers are known, and with them any tilt.
    pub fn knows_tilts(&self) -> bool {
        self.plate.is_known()
    }

    /// Whether `pose` is reached.
    pub fn contains(&self, pose: &PlatePose) -> bool {
        (self.low_um..=self.top_um).contains(&pose.z_um) && self.share(pose) == 1.0
    }

    /// The nearest pose with the same piston, or the end of the range that is nearer to it, and tilts in the same direction.
    pub fn nearest(&self, pose: &PlatePose) -> PlatePose {
        let level = PlatePose {
            z_um: pose.z_um.clamp(self.low_um, self.top_um),
            ..*pose
        };
        let share = self.share(&level);
        PlatePose {
            tilt_x_rad: share * pose.tilt_x_rad,
            tilt_y_rad: share * pose.tilt_y_rad,
            ..level
        }
    }

    /// From the lowest to the highest piston (um) at which these tilts are reached, if there is any.
    pub fn pistons_um(&self, tilt_x_rad: f64, tilt_y_rad: f64) -> Option<(f64, f64)> {
        let tilted = self.tilted_um(tilt_x_rad, tilt_y_rad);
        self.interval(tilted, [1.0; CHANNELS])
    }

    /// The largest tilt (rad) that is reached at a piston, where the tilts about x and y are in the ratio of these two.
    pub fn largest_tilt_rad(&self, z_um: f64, (along_x, along_y): (f64, f64)) -> f64 {
        let length = along_x.hypot(along_y);
        let per_rad = self.tilted_um(along_x / length, along_y / length);
        self.interval([z_um; CHANNELS], per_rad)
            .map_or(0.0, |(_, most)| most.max(0.0))
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

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::{Limits, PlateInverse};
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
        let mut limits = Limits::NONE;
        let inverse = PlateInverse::new(plate, Micrometre(TOP_UM as f32));
        inverse.positions(&Pose::from(*pose), &mut limits);
        limits
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
