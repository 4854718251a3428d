//! Levers, and each actuator's own shape, from poses that were measured.
//!
//! With small angles the three coordinates of a rigid plate are sums of what each actuator adds:
//!
//! ```text
//! (z, tilt_x, tilt_y) = sum over i of share_i * f_i(d_i)
//! ```
//!
//! `d_i` is the position at which the table of actuator i says what it is warm, `f_i` the one that it took, a smooth bend of it, and
//! `share_i` what it moves the plate by. How warm it is follows from what was asked before, by the poles of the calibration; how much of
//! each pole the four actuators share, how the loss of each grows, and the pose at which the instrument has its zero are sought with the
//! rest, all of it by least squares with a prior.
//! Positions are counted so that a level plate has all four actuators where it is itself, which leaves one scale, along the warp. Only
//! poses with a warp show it, and only they depend on it; levers are exact up to that scale.
//!
//! - `alone`: poses whose reading stands alone;
//! - `course`: poses on the way;
//! - `drives`: which poses the drives hold;
//! - `point`: what was measured;
//! - `history`: from what was asked to how warm the actuators were;
//! - `fit`: what is sought, and how;
//! - `outcome`: the calibration that it makes, and where its range ends;
//! - `late`: where a plate on its way was when a late instrument saw it;
//! - `stages`: what of an actuator's stages changes with it;
//! - `plausible`: which poses tell a plate, and which plate a mirror can have;
//! - `spots`: poses from a displacement sensor whose spot is moved.

mod alone;
mod course;
mod drives;
mod fit;
mod heat;
mod history;
mod late;
mod outcome;
mod plausible;
mod point;
mod spots;
mod stages;
mod tables;

pub use self::course::{COURSE_S, COURSE_STEP_S, along_a_course, course};
pub use self::point::{PoseError, PosePoint};
pub use self::spots::{SpotHeights, are_on_a_line, check_from_rest, check_moved, poses_over_spots};

use control_core::calibration::{Parts, Plate};
use control_core::{Calibration, Micrometre};

pub(crate) use self::drives::largest;
pub use self::drives::{Cause, Drives, NotHeld};
use self::fit::{Found, PlateFit};
use self::outcome::Outcome;
use self::point::FEWEST;
use crate::plate_pose::PlatePose;
use crate::reach::Reach;

/// A calibration that leaves more than this of the range follows no plate: a tenth of what the factory's leaves.
const FOLLOWS: f64 = 0.01;

/// A calibration with levers.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// What a board needs.
    pub calibration: Calibration,
    /// Root mean square of what it leaves of the pistons (um).
    pub piston_rms_um: f64,
    /// And of the tilts (rad).
    pub tilt_rms_rad: f64,
    /// The pose at which what was measured is zero: the rest that it counts from, of a mirror that was moved.
    pub zero: PlatePose,
    /// Poses whose reading stood alone, and bore no weight.
    pub left_out: Vec<LeftOut>,
    /// By which angle its actuators are turned around the plate against the calibration before (rad): above 0 from x towards y.
    pub turned_rad: f64,
}

/// A pose whose reading stood alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Its number among all, from 0.
    pub point: usize,
    /// What was asked for there.
    pub asked: PlatePose,
    /// How far it was from where the plate of the others is (um), tilts counted at the actuators.
    pub off_um: f64,
}

impl Posed {
    /// What it promises of the plate's height above a spot, x and y from its centre in um (um, root mean square).
    pub fn promised_rms_um(&self, [x_um, y_um]: [f64; 2]) -> f64 {
        self.piston_rms_um
            .hypot(x_um.hypot(y_um) * self.tilt_rms_rad)
    }
}

/// Poses that tell levers and shapes: level ones all over the range, and tilts to both sides about both axes, the largest ones
/// near rest with a warp. Neighbours in time lie far apart, so that no drift looks like a shape.
pub fn poses_to_measure(calibration: &Calibration, top_um: f64) -> Vec<PlatePose> {
    const LEVELS: usize = 12;
    const STRIDE: usize = 5;
    /// Level ones besides, as parts of the range, at whose ends the shapes would be guessed from the poses within: the low ones, to which a
    /// mirror takes long to cool, before anything else and from above. Half and a quarter of a step between levels, and nearly the end: a choice.
    const LOW: [f64; 2] = [0.04, 0.02];
    const HIGH: f64 = 0.99;
    /// Steps from where the calibration was tried to there: as many as leave each a hundredth of the range.
    const UNTRIED_LEVELS: usize = 8;
    /// Parts of the largest tilt there is, and none of its end, where limits act: a choice.
    const PARTS: [f64; 3] = [0.15, 0.45, 0.8];
    let parts = calibration.parts();
    let reach = Reach::new(parts.plate, top_um);
    let drives = Drives::new(parts);
    let level = |z_um: f64| PlatePose {
        z_um,
        ..PlatePose::default()
    };
    let mut poses = Vec::from(LOW.map(|part| level(part * top_um)));
    for step in 0..LEVELS {
        let z_um = top_um * (1 + step * STRIDE % LEVELS) as f64 / (LEVELS + 1) as f64;
        poses.push(level(z_um));
        for (turn, sign) in [(0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0)] {
            let part = PARTS[(step + turn) % PARTS.len()];
            let direction = [(sign, 0.0), (0.0, sign)][turn];
            let tilted = |rad: f64| PlatePose {
                z_um,
                tilt_x_rad: rad * direction.0,
                tilt_y_rad: rad * direction.1,
            };
            let most_rad = drives.largest_tilt_rad(reach.largest_tilt_rad(z_um, direction), tilted);
            poses.push(tilted(part * most_rad));
        }
    }
    let tried_um = f64::from(parts.residual.tried.0);
    if parts.residual.is_tried() && tried_um < HIGH * top_um {
        let steps = 1..UNTRIED_LEVELS;
        let part = |step: usize| step as f64 / UNTRIED_LEVELS as f64;
        let there = steps.map(|step| tried_um + part(step) * (HIGH * top_um - tried_um));
        poses.extend(there.map(level));
    }
    poses.push(level(HIGH * top_um));
    poses
}

/// Lever that is assumed until it is measured (um): that of plates of half a millimetre.
const ASSUMED_LEVER: Micrometre = Micrometre(500.0);

/// With levers to begin with, where there are none: those of a square plate of half a millimetre.
pub fn with_assumed_levers(calibration: &Calibration) -> Calibration {
    let parts = calibration.parts();
    if parts.plate.is_known() {
        return *calibration;
    }
    Calibration::new(Parts {
        plate: Plate::cross(ASSUMED_LEVER),
        ..*parts
    })
    .expect("levers of a square plate are levers")
}

/// A plate, and what was screened from its poses.
struct Screened {
    fit: PlateFit,
    found: Found,
    left_out: Vec<LeftOut>,
}

impl Screened {
    /// The plate of all points.
    fn of(parts: &Parts, points: &[PosePoint]) -> Result<Self, PoseError> {
        let mut fit = PlateFit::new(parts, points);
        let found = fit.best().ok_or(PoseError::Unfit)?;
        Ok(Self {
            fit,
            found,
            left_out: Vec::new(),
        })
    }

    /// The plate of all points but those that stand alone: the one that is off by most bends the plate, and with it what the others leave, so
    /// they are found one after the other. Where they are many, that of all.
    fn without_those_alone(parts: &Parts, points: &[PosePoint]) -> Result<Self, PoseError> {
        let of_all = Self::of(parts, points)?;
        let rests = points.iter().filter(|point| point.is_rest()).count();
        let mut some = points.to_vec();
        let mut left_out = Vec::new();
        let mut fitted = None;
        loop {
            let now = fitted.as_ref().unwrap_or(&of_all);
            let Some((point, off_um)) = alone::alone(&now.fit.left_at_rest_um(&now.found)) else {
                break;
            };
            left_out.push(LeftOut {
                point,
                asked: points[point].asked,
                off_um,
            });
            if left_out.len() as f64 > alone::MOST * rests as f64 {
                return Ok(of_all);
            }
            some[point].reached = None;
            fitted = Some(Self::of(parts, &some)?);
        }
        let fitted = fitted.unwrap_or(of_all);
        Ok(Self { left_out, ..fitted })
    }
}

/// `calibration` with levers, and tables of each actuator's own, so that what was reached is what will be asked for.
///
/// # Errors
/// Where there are too few points, or no plate moves like this.
pub fn posed(calibration: &Calibration, points: &[PosePoint]) -> Result<Posed, PoseError> {
    let parts = calibration.parts();
    if !parts.plate.is_known() {
        return Err(PoseError::NoLevers);
    }
    let rests = points.iter().filter(|point| point.is_rest()).count();
    if rests < FEWEST {
        return Err(PoseError::TooFew(rests));
    }
    let is_finite = |point: &PosePoint| {
        let numbers = |pose: PlatePose| [pose.z_um, pose.tilt_x_rad, pose.tilt_y_rad];
        let asked = numbers(point.asked).into_iter();
        let mut all = asked.chain(point.reached.into_iter().flat_map(numbers));
        let told = point.told_k.iter().flatten();
        all.all(f64::is_finite) && point.held_s.is_finite() && told.copied().all(f64::is_finite)
    };
    if let Some(bad) = points.iter().position(|point| !is_finite(point)) {
        return Err(PoseError::NotFinite(bad + 1));
    }
    plausible::check_asked(points, f64::from(calibration.max_position().0))?;
    let Screened {
        fit,
        found,
        left_out,
    } = Screened::without_those_alone(parts, points)?;
    let (piston_um, tilts_um) = fit.rms_um(&found);
    let left_um = (piston_um * piston_um + 2.0 * tilts_um * tilts_um).sqrt();
    // Not so for NaN.
    let follows = left_um <= FOLLOWS * fit.top_um;
    if !follows {
        let (worst, worst_um) = alone::worst(&fit.left_at_rest_um(&found)).unwrap_or_default();
        return Err(PoseError::NoPlate {
            left_um,
            worst: worst + 1,
            worst_um,
        });
    }
    let outcome = Outcome {
        parts,
        fit: &fit,
        found: &found,
    };
    let calibration = outcome.calibration(points)?;
    Ok(Posed {
        turned_rad: plausible::turned_rad(&calibration.parts().plate, &parts.plate),
        calibration,
        left_out,
        piston_rms_um: piston_um,
        tilt_rms_rad: tilts_um / fit.lever_um,
        zero: PlatePose {
            z_um: found.zero_um.x,
            tilt_x_rad: found.zero_um.y / fit.lever_um,
            tilt_y_rad: found.zero_um.z / fit.lever_um,
        },
    })
}
