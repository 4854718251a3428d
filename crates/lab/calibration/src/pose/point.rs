//! A pose that was measured, and why poses do not make a calibration.

use control_core::{CHANNELS, CalibrationError};

use crate::plate_pose::PlatePose;

/// Fewer poses at rest than this leave too much to what was assumed: three numbers a pose, for some sixty unknowns with a prior each.
pub(super) const FEWEST: usize = 16;
/// What was asked for so long is a rest (s): ten moves.
const REST_S: f64 = 0.05;

/// A pose that was asked of the core under a calibration, and the one that the plate had then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePoint {
    /// What was asked for.
    pub asked: PlatePose,
    /// For how long, until it was measured (s). The first was asked of a mirror at rest, each of the others right after the one before.
    pub held_s: f64,
    /// What was measured; `None` where nothing was, or a limit held the plate elsewhere.
    pub reached: Option<PlatePose>,
    /// Temperature rises that the heaters' resistances told then, by the calibration's straight line (K); `None` where they told none.
    pub told_k: Option<[f64; CHANNELS]>,
}

impl PosePoint {
    /// Whether it was measured at rest.
    pub(crate) fn is_rest(&self) -> bool {
        self.reached.is_some() && self.is_long_held()
    }

    /// Whether it was asked for until the plate was at rest.
    pub(super) fn is_long_held(&self) -> bool {
        self.held_s >= REST_S
    }
}

/// Why poses do not make a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// Too few.
    #[error("{0} measured poses are too few to find levers and shapes; measure at least {FEWEST}")]
    TooFew(usize),
    /// The calibration that they were asked under has no levers, not even rough ones.
    #[error("the calibration under which the poses were asked for has no levers")]
    NoLevers,
    /// A number of a pose is not finite.
    #[error("pose {0} of those measured has a number that is not finite")]
    NotFinite(usize),
    /// They leave the upper half of the range to be guessed.
    #[error(
        "the highest pose that was asked for is {highest_um:.3} um of {top_um:.1}; poses are in micrometres and degrees, and reach at least \
         half of the range"
    )]
    TooLow {
        /// The highest that was measured at rest (um).
        highest_um: f64,
        /// The range of the calibration (um).
        top_um: f64,
    },
    /// They tell one lever only, or none.
    #[error("the poses tilt about one axis only, or not at all; ask for tilts about x and about y")]
    OneAxis,
    /// An actuator would act where no mirror has one.
    #[error(
        "actuator {actuator} would act {um:.0} um from the plate's centre; are tilts in degrees, and spots in micrometres?"
    )]
    Lever {
        /// From 1.
        actuator: usize,
        /// How far from the centre (um).
        um: f64,
    },
    /// The actuators would follow each other around the plate the other way.
    #[error(
        "actuators 1 to 4 would follow each other around the plate the other way than in the calibration before: were two spots exchanged, or, of \
         an instrument of two axes, the axes, or is one of them reversed? Where they do so in your axes, turn the sign of all y"
    )]
    Reflected,
    /// One actuator would bend the plate less than half as much as another.
    #[error(
        "actuator {0} would carry much less of the plate than the others; were two spots mixed up, or, of an instrument of two axes, is one of them reversed, or its zero not the plate at rest?"
    )]
    Lopsided(usize),
    /// Heights that are not those of the calibration's trial.
    #[error(
        "the poses put a level plate at {found_um:.1} um where the calibration, which was tried, has it at {had_um:.1} um; were they measured \
         on this mirror, in micrometres from its rest?"
    )]
    OtherPiston {
        /// By the poses (um).
        found_um: f64,
        /// By the calibration (um).
        had_um: f64,
    },
    /// What the instrument took for rest is another plate.
    #[error(
        "counted from the rest that was read, all poses are tilted by {tilt_deg:.3} deg; did sensor, spot or mirror move after a rest was read? \
         Measure all spots again, in another folder"
    )]
    OtherRest {
        /// By how much (deg).
        tilt_deg: f64,
    },
    /// They do not tell two tilts.
    #[error(
        "the spots lie on a line, or are fewer than three; move the sensor's spot to three corners of the plate"
    )]
    SpotsOnALine,
    /// Two spots where one was meant to be.
    #[error(
        "spots {first} and {second} read the same at every pose: the sensor's spot was not moved between them, or the plate never tilts along the \
         line between them; measure again, in another folder"
    )]
    SameHeights {
        /// From 1, in the order in which they were measured.
        first: usize,
        /// From 1.
        second: usize,
    },
    /// Rest was read too high under a spot.
    #[error(
        "under spot {spot} what the sensor reads begins {below_um:.2} um lower than under the others, and not at rest: its range begins above the \
         plate's rest there, or it moved after rest was read; set it so that rest lies within its range, and measure again, in another folder"
    )]
    Begins {
        /// From 1, in the order in which they were measured.
        spot: usize,
        /// By how much (um).
        below_um: f64,
    },
    /// The heights of more than three spots are on no plane.
    #[error(
        "the plate would be bent: {left_um:.2} um are left of the heights above its spots; were they where they are said to be?"
    )]
    NotRigid {
        /// Root mean square of what is left (um).
        left_um: f64,
    },
    /// No plate that four actuators carry moves like this.
    #[error(
        "no plate follows what was measured: {left_um:.2} um are left, {worst_um:.2} um of pose {worst}; were the tilts measured on this mirror, and the sensor's spot where it is said to be?"
    )]
    NoPlate {
        /// Root mean square of what is left at an actuator (um).
        left_um: f64,
        /// The pose that leaves most, from 1.
        worst: usize,
        /// How much that is (um).
        worst_um: f64,
    },
    /// The search for a plate ended nowhere.
    #[error(
        "no plate was found that follows what was measured; were the tilts measured on this mirror?"
    )]
    Unfit,
    /// More asked was not more reached.
    #[error("actuator {0} does not go further when it is asked to")]
    NotRising(usize),
    /// The numbers are beyond what a board takes.
    #[error("the poses give no calibration: {0}")]
    Calibration(#[from] CalibrationError),
}
