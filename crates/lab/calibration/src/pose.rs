//! Levers, and each actuator's own shape, from poses that were measured at rest.
//!
//! With small angles the three coordinates of a rigid plate are sums of what each actuator adds:
//!
//! ```text
//! (z, tilt_x, tilt_y) = sum over i of share_i * f_i(d_i)
//! ```
//!
//! `d_i` is the position that actuator i was asked for, `f_i` the one that it took, a polynomial without a constant, and
//! `share_i` what it moves the plate by. Least squares with either of the two held alternate (the criss-cross regression of
//! Gabriel and Zamir 1979). What heats the neighbours is in the shares, as far as it is proportional to an actuator's own
//! heating. Positions are counted so that a level plate has all four actuators where it is itself, which leaves one scale, along
//! the warp. Only poses with a warp show it, and only they depend on it; levers are exact up to that scale.

use std::f64::consts::SQRT_2;

use control_core::calibration::{Lever, Parts, Plate, Residual};
use control_core::shape::SEGMENTS;
use control_core::{
    CHANNELS, Calibration, CalibrationError, Limits, Micrometre, PlateInverse, Pose, Radian,
};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x4, SMatrix, Vector3, Vector4};

use crate::correct::bent;
use crate::curve::Curve;
use crate::reach::{PlatePose, Reach};
use crate::residual::LEAST_UM;

/// Coefficients of an actuator's polynomial. Over a table that was bent by the mean of all four, what is left of one is smooth.
const TERMS: usize = 5;
/// Fewer poses than this leave the unknowns open: four polynomials and twelve shares, from three numbers a pose.
const FEWEST: usize = 16;
/// Rounds of the alternation: a plate that is known exactly is followed to some nanometres by then (`tests/pose.rs`).
const ROUNDS: usize = 300;
/// Weight of what is known from before against what a pose tells: it decides only what no pose does.
const PRIOR: f64 = 1e-4;
/// A calibration that leaves more than this of the range follows no plate: a tenth of what the factory's leaves.
const FOLLOWS: f64 = 0.01;

/// A pose that was asked of the core under a calibration, and the one that the plate came to rest in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePoint {
    /// What was asked for.
    pub asked: PlatePose,
    /// What was measured.
    pub reached: PlatePose,
}

/// A calibration with levers.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// What a board needs.
    pub calibration: Calibration,
    /// Root mean square of what it leaves of the pistons (um).
    pub piston_rms_um: f64,
    /// And of the tilts (rad).
    pub tilt_rms_rad: f64,
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
    /// No plate that four actuators carry moves like this.
    #[error(
        "no plate follows what was measured: {left_um:.2} um are left; were the tilts measured on this mirror, and the sensor's spot where it is said to be?"
    )]
    NoPlate {
        /// Root mean square of what is left at an actuator (um).
        left_um: f64,
    },
    /// More asked was not more reached.
    #[error("actuator {0} does not go further when it is asked to")]
    NotRising(usize),
    /// The numbers are beyond what a board takes.
    #[error("the poses give no calibration: {0}")]
    Calibration(#[from] CalibrationError),
}

/// Poses that tell levers and shapes: level ones all over the range, and tilts to both sides about both axes, the largest ones
/// near rest with a warp. Neighbours in time lie far apart, so that no drift looks like a shape.
pub fn poses_to_measure(reach: &Reach, top_um: f64) -> Vec<PlatePose> {
    const LEVELS: usize = 12;
    const STRIDE: usize = 5;
    /// Parts of the largest tilt there is.
    const PARTS: [f64; 3] = [0.15, 0.45, 0.8];
    let mut poses = Vec::new();
    for step in 0..LEVELS {
        let z_um = top_um * (1 + step * STRIDE % LEVELS) as f64 / (LEVELS + 1) as f64;
        poses.push(PlatePose {
            z_um,
            ..PlatePose::default()
        });
        for (turn, sign) in [(0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0)] {
            let part = PARTS[(step + turn) % PARTS.len()];
            let direction = [(sign, 0.0), (0.0, sign)][turn];
            let rad = part * reach.largest_tilt_rad(z_um, direction);
            poses.push(PlatePose {
                z_um,
                tilt_x_rad: rad * direction.0,
                tilt_y_rad: rad * direction.1,
            });
        }
    }
    poses
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
    if points.len() < FEWEST {
        return Err(PoseError::TooFew(points.len()));
    }
    let is_finite = |point: &PosePoint| {
        let PlatePose {
            z_um,
            tilt_x_rad,
            tilt_y_rad,
        } = point.reached;
        [z_um, tilt_x_rad, tilt_y_rad]
            .iter()
            .all(|number| number.is_finite())
    };
    if let Some(bad) = points.iter().position(|point| !is_finite(point)) {
        return Err(PoseError::NotFinite(bad + 1));
    }
    let mut fit = Fit::new(parts, points);
    for _ in 0..ROUNDS {
        fit.shapes();
        fit.shares();
    }
    fit.count_from_level();
    let left_um = fit.left_um();
    if left_um.is_nan() || left_um > FOLLOWS * fit.top_um {
        return Err(PoseError::NoPlate { left_um });
    }
    let (piston_rms_um, tilt_rms_um) = fit.rms_um();
    Ok(Posed {
        calibration: fit.calibration(parts)?,
        piston_rms_um,
        tilt_rms_rad: tilt_rms_um / fit.lever_um,
    })
}

/// Shares and shapes as they are found. Tilts are multiplied by a lever, so that all three coordinates are in micrometres.
struct Fit {
    top_um: f64,
    /// Mean distance of the levers from the centre under the former calibration (um).
    lever_um: f64,
    /// Positions that the actuators were asked for, as parts of the range.
    asked: Vec<[f64; CHANNELS]>,
    reached_um: Vec<Vector3<f64>>,
    /// What each actuator's position adds to the coordinates (um/um).
    shares: Matrix3x4<f64>,
    /// Coefficients of each actuator's polynomial (um).
    shapes: SMatrix<f64, TERMS, CHANNELS>,
}

impl Fit {
    /// What the former calibration says.
    fn new(parts: &Parts, points: &[PosePoint]) -> Self {
        let top = parts.actuators[0].shape.top();
        let top_um = f64::from(top.0);
        let plate = PlateInverse::new(&parts.plate, top);
        let radii = parts
            .plate
            .levers
            .map(|lever| f64::from(lever.x.0.hypot(lever.y.0)));
        let lever_um = radii.iter().sum::<f64>() / CHANNELS as f64;
        let asked = |point: &PosePoint| {
            let pose = Pose {
                z: Micrometre(point.asked.z_um as f32),
                tilt_x: Radian(point.asked.tilt_x_rad as f32),
                tilt_y: Radian(point.asked.tilt_y_rad as f32),
            };
            // As the core has it; what limits it is in the positions.
            let mut limits = Limits::NONE;
            let positions = plate.positions(&pose, &mut limits);
            positions.map(|um| f64::from(um) / top_um)
        };
        let coordinates = |pose: &PlatePose| {
            Vector3::new(
                pose.z_um,
                pose.tilt_x_rad * lever_um,
                pose.tilt_y_rad * lever_um,
            )
        };
        let mut shares = Matrix3x4::<f64>::zeros();
        for i in 0..CHANNELS {
            let mut alone = [0.0; CHANNELS];
            alone[i] = 1.0;
            let Pose { z, tilt_x, tilt_y } = plate.pose(&alone);
            let column = [z.0, tilt_x.0 * lever_um as f32, tilt_y.0 * lever_um as f32];
            shares.set_column(i, &Vector3::from(column.map(f64::from)));
        }
        let mut shapes = SMatrix::<f64, TERMS, CHANNELS>::zeros();
        shapes.row_mut(0).fill(top_um);
        Self {
            top_um,
            lever_um,
            asked: points.iter().map(asked).collect(),
            reached_um: points
                .iter()
                .map(|point| coordinates(&point.reached))
                .collect(),
            shares,
            shapes,
        }
    }

    /// The polynomials, with the shares held.
    fn shapes(&mut self) {
        let terms: Vec<_> = self.asked.iter().map(|asked| asked.map(powers)).collect();
        let row = |point: usize, axis: usize| {
            let mut row = Vec::with_capacity(CHANNELS * TERMS);
            for (i, terms) in terms[point].iter().enumerate() {
                row.extend(terms.map(|term| self.shares[(axis, i)] * term));
            }
            row
        };
        let before = DVector::from_column_slice(self.shapes.as_slice());
        let found = self.solve(&row, &before);
        self.shapes.copy_from_slice(found.as_slice());
    }

    /// The shares, with the polynomials held.
    fn shares(&mut self) {
        let taken: Vec<_> = self
            .asked
            .iter()
            .map(|asked| self.taken_um(asked))
            .collect();
        let row = |point: usize, axis: usize| {
            let mut row = vec![0.0; 3 * CHANNELS];
            for (i, taken_um) in taken[point].iter().enumerate() {
                row[3 * i + axis] = *taken_um;
            }
            row
        };
        let before = DVector::from_column_slice(self.shares.as_slice());
        let found = self.solve(&row, &before);
        self.shares.copy_from_slice(found.as_slice());
    }

    /// Least squares of all coordinates, with a little weight on what was before.
    fn solve(&self, row: &dyn Fn(usize, usize) -> Vec<f64>, before: &DVector<f64>) -> DVector<f64> {
        let unknowns = before.len();
        let (mut normal, mut right) =
            (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for (point, reached) in self.reached_um.iter().enumerate() {
            for axis in 0..3 {
                let row = DVector::from_vec(row(point, axis));
                normal.ger(1.0, &row, &row, 1.0);
                right.axpy(reached[axis], &row, 1.0);
            }
        }
        let scale = PRIOR * normal.diagonal().mean();
        for i in 0..unknowns {
            normal[(i, i)] += scale;
        }
        right.axpy(scale, before, 1.0);
        normal
            .cholesky()
            .map_or_else(|| before.clone(), |factor| factor.solve(&right))
    }

    /// Where actuators go that are asked for these parts of the range (um).
    fn taken_um(&self, asked: &[f64; CHANNELS]) -> [f64; CHANNELS] {
        std::array::from_fn(|i| self.shape_um(i, asked[i]))
    }

    fn shape_um(&self, actuator: usize, asked: f64) -> f64 {
        let coefficients = self.shapes.column(actuator);
        let products = powers(asked).into_iter().zip(coefficients.iter());
        products.map(|(term, coefficient)| term * coefficient).sum()
    }

    /// Counts the actuators' positions so that they are alike where the plate is level, with the least change of scale.
    fn count_from_level(&mut self) {
        let ones = Vector4::repeat(1.0);
        let missing = Vector3::x() - self.shares * ones;
        let square: Matrix3<f64> = self.shares * self.shares.transpose();
        let Some(inverse) = square.try_inverse() else {
            return;
        };
        let scale = ones + self.shares.transpose() * inverse * missing;
        for i in 0..CHANNELS {
            self.shares.column_mut(i).scale_mut(scale[i]);
            self.shapes.column_mut(i).scale_mut(1.0 / scale[i]);
        }
    }

    /// What is left of the coordinates at each point (um).
    fn residuals_um(&self) -> impl Iterator<Item = Vector3<f64>> {
        let points = self.asked.iter().zip(&self.reached_um);
        points.map(|(asked, reached)| reached - self.shares * Vector4::from(self.taken_um(asked)))
    }

    fn left_um(&self) -> f64 {
        let squares: f64 = self.residuals_um().map(|left| left.norm_squared()).sum();
        (squares / self.asked.len() as f64).sqrt()
    }

    /// Of the piston and of the tilts.
    fn rms_um(&self) -> (f64, f64) {
        let count = self.asked.len() as f64;
        let (mut piston, mut tilts) = (0.0, 0.0);
        for left in self.residuals_um() {
            piston += left.x * left.x;
            tilts += 0.5 * (left.y * left.y + left.z * left.z);
        }
        ((piston / count).sqrt(), (tilts / count).sqrt())
    }

    /// What is unknown of a plate whose poses leave this. The difference of two actuators tilts it, each with half of it.
    fn residual(&self, before: &Residual) -> Residual {
        let (piston_um, tilts_um) = self.rms_um();
        let squares = self.asked.iter().flatten().map(|part| part * part);
        let places = (self.asked.len() * CHANNELS) as f64;
        let asked_um = self.top_um * (squares.sum::<f64>() / places).sqrt();
        Residual {
            piston: Micrometre(piston_um.max(LEAST_UM) as f32),
            part: 0.0,
            apart: (SQRT_2 * tilts_um / asked_um) as f32,
            ..*before
        }
    }

    fn plate(&self) -> Option<Plate> {
        let square: Matrix3<f64> = self.shares * self.shares.transpose();
        let levers = self.shares.transpose() * square.try_inverse()?;
        let warp = warp(&self.shares);
        let mut plate = Plate::UNKNOWN;
        for (i, lever) in plate.levers.iter_mut().enumerate() {
            *lever = Lever {
                x: Micrometre((-levers[(i, 2)] * self.lever_um) as f32),
                y: Micrometre((levers[(i, 1)] * self.lever_um) as f32),
                warp: warp[i] as f32,
            };
        }
        Some(plate)
    }

    fn calibration(&self, parts: &Parts) -> Result<Calibration, PoseError> {
        let left_um = self.left_um();
        let plate = self.plate().ok_or(PoseError::NoPlate { left_um })?;
        let tops = (0..CHANNELS).map(|i| self.shape_um(i, 1.0));
        let top_um = tops.fold(f64::INFINITY, f64::min);
        let mut actuators = parts.actuators;
        for (i, actuator) in actuators.iter_mut().enumerate() {
            let places = (0..=SEGMENTS).map(|step| step as f64 / SEGMENTS as f64);
            let asked_um = places.clone().map(|place| place * self.top_um).collect();
            let taken_um = places.map(|place| self.shape_um(i, place)).collect();
            let asked_at =
                Curve::new(taken_um, asked_um).map_err(|_| PoseError::NotRising(i + 1))?;
            actuator.shape = bent(actuator, top_um, &asked_at)?;
        }
        Ok(Calibration::new(Parts {
            actuators,
            plate,
            residual: self.residual(&parts.residual),
            ..*parts
        })?)
    }
}

/// The terms of a polynomial that is zero at rest.
fn powers(asked: f64) -> [f64; TERMS] {
    std::array::from_fn(|k| asked.powi(k as i32 + 1))
}

/// The direction of the actuators' positions that does not move the plate, its largest part 1.
fn warp(shares: &Matrix3x4<f64>) -> Vector4<f64> {
    let minor = |skipped: usize| {
        let sign = if skipped.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * shares.remove_column(skipped).determinant()
    };
    let warp = Vector4::new(minor(0), minor(1), minor(2), minor(3));
    warp / warp[warp.iamax()]
}
