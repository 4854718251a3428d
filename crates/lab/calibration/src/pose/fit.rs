//! The fit of a plate on four actuators to poses: shapes, shares, what the actuators share of their heat, how their losses grow, and where
//! the instrument's zero is.

use control_core::calibration::{Lag, POLES, Parts};
use control_core::{CHANNELS, Micrometre, PlateInverse, Pose};
use least_squares::{Bounds, DifferenceStep, Options, Prior, Problem, minimise};
use nalgebra::{DVector, Matrix3, Matrix3x4, Vector3, Vector4};

use super::history::{Place, Table, places, tables};
use super::point::PosePoint;
use crate::reach::PlatePose;
use crate::refine::bend_terms;

/// Terms of what an actuator's shape is apart from its table. Over one that was bent by the mean of all four, that is smooth.
const TERMS: usize = 7;
/// Standard deviations of what is sought, before anything was measured: a term of a shape, as a part of the range (that of a table that
/// nobody tried); a share, of which four make one piston; the shared part of a pole, which is anything from 0 to 1; the growth of the
/// loss (1/K), of which 3 % of a loss at some 60 K make 3e-4.
const SHAPE: f64 = 0.05;
const SHARE: f64 = 0.1;
const SHARED: f64 = 0.5;
const GROWTH_PER_K: f64 = 5e-4;
/// And the instrument's zero, the plate's rest when it was read (um): hysteresis leaves a mirror that was moved off the rest of one that never
/// was, the paper's virtual mirror by 0.3 um.
const ZERO_UM: f64 = 0.5;
/// Least growth of a loss (1/K): what a board takes. One that falls with the rise stands for an actuator that loses less than the others.
const LEAST_GROWTH_PER_K: f64 = -1e-3;
/// A pole may be shared from here on (s): the core takes no faster ones.
const FASTEST_SHARED_S: f64 = 0.01;
/// A pole of less weight, 0.3 um of the range, tells nothing of what shares it: a choice.
const LEAST_WEIGHT: f64 = 2e-3;
/// What instruments and stages leave of a coordinate at rest (um), a sensor's 20 nm, and on the way, where a plate rings: a twentieth of
/// the course.
const AT_REST_UM: f64 = 0.02;
const ON_THE_WAY_UM: f64 = 0.5;
/// What a fit leaves at rest beyond that is no noise but hysteresis and creep, which poses share that follow each other. Where nothing was
/// read on the way, which tells them from shared heat and growing losses, it counts as so many deviations: with three, tilts elsewhere are
/// missed by half as much on the paper's virtual mirror.
const SYSTEMATIC: f64 = 3.0;
/// Difference step, in standard deviations: far above rounding, and far below one.
const DIFFERENCE: f64 = 1e-5;
/// A fit ends where a step gains, or moves, no more than this share: a choice, far below what noise leaves open.
const TOLERANCE: f64 = 1e-9;
const MOST_EVALUATIONS: usize = 60;

/// What was measured, under a calibration.
pub(super) struct PlateFit {
    pub(super) top_um: f64,
    /// Mean distance of the levers from the centre under the former calibration (um). Tilts are multiplied by it, so that all three
    /// coordinates are in micrometres.
    pub(super) lever_um: f64,
    pub(super) tables: [Table; CHANNELS],
    places: Vec<[Place; CHANNELS]>,
    reached_um: Vec<Vector3<f64>>,
    deviations_um: Vec<f64>,
    /// Which of them were read at rest.
    are_rests: Vec<bool>,
    /// What each actuator's position adds to the coordinates under the former calibration (um/um).
    shares: Matrix3x4<f64>,
    /// Poles that may be shared, and by how much they are.
    poles: Vec<(usize, f64)>,
    growths: [f64; CHANNELS],
}

/// What is sought.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Coefficients of what each actuator's shape is apart from its table, as parts of the range.
    shapes: [[f64; TERMS]; CHANNELS],
    /// What each actuator's position adds to the coordinates (um/um).
    pub(super) shares: Matrix3x4<f64>,
    /// By how much more each pole is shared.
    pub(super) more_shared: [f64; POLES],
    /// By how much more each actuator's loss grows (1/K).
    pub(super) more_growth: [f64; CHANNELS],
    /// The coordinates at which what was measured is zero (um).
    pub(super) zero_um: Vector3<f64>,
}

impl PlateFit {
    pub(super) fn new(parts: &Parts, points: &[PosePoint]) -> Self {
        let top = parts.actuators[0].shape.top();
        let plate = PlateInverse::new(&parts.plate, top);
        let radii = parts
            .plate
            .levers
            .map(|lever| f64::from(lever.x.0.hypot(lever.y.0)));
        let lever_um = radii.iter().sum::<f64>() / CHANNELS as f64;
        let coordinates = |pose: &PlatePose| {
            let PlatePose {
                z_um,
                tilt_x_rad,
                tilt_y_rad,
            } = *pose;
            Vector3::new(z_um, tilt_x_rad * lever_um, tilt_y_rad * lever_um)
        };
        let mut shares = Matrix3x4::zeros();
        for i in 0..CHANNELS {
            let mut alone = [0.0; CHANNELS];
            alone[i] = 1.0;
            let Pose { z, tilt_x, tilt_y } = plate.pose(&alone);
            let Micrometre(z) = z;
            let column = [z, tilt_x.0 * lever_um as f32, tilt_y.0 * lever_um as f32];
            shares.set_column(i, &Vector3::from(column.map(f64::from)));
        }
        let poles = parts.heat.poles().into_iter().zip(parts.heat.shared);
        let may_be_shared = |(k, (pole, shared)): (usize, (Lag, f32))| {
            let is_a_frames = k > 0
                && f64::from(pole.time.0) >= FASTEST_SHARED_S
                && f64::from(pole.weight) >= LEAST_WEIGHT;
            is_a_frames.then_some((k, f64::from(shared)))
        };
        let deviation = |point: &PosePoint| match point.is_rest() {
            true => AT_REST_UM,
            false => ON_THE_WAY_UM,
        };
        let read = |point: &PosePoint| point.reached.is_some();
        let all = places(parts, points).into_iter().zip(points);
        Self {
            top_um: f64::from(top.0),
            lever_um,
            tables: tables(parts),
            places: all
                .filter(|(_, point)| read(point))
                .map(|it| it.0)
                .collect(),
            reached_um: points
                .iter()
                .filter_map(|point| point.reached.as_ref().map(coordinates))
                .collect(),
            deviations_um: points.iter().filter(|it| read(it)).map(deviation).collect(),
            are_rests: points
                .iter()
                .filter(|it| read(it))
                .map(PosePoint::is_rest)
                .collect(),
            shares,
            poles: poles.enumerate().filter_map(may_be_shared).collect(),
            growths: parts
                .actuators
                .each_ref()
                .map(|actuator| f64::from(actuator.loss_growth.0)),
        }
    }

    /// The best plate near the former calibration's; `None` where there is none.
    pub(super) fn best(&mut self) -> Option<Found> {
        let found = self.nearest()?;
        if self.are_rests.contains(&false) {
            return Some(found);
        }
        let (piston_um, tilts_um) = self.rms_um(&found);
        let left_um = ((piston_um * piston_um + 2.0 * tilts_um * tilts_um) / 3.0).sqrt();
        let deviation_um = AT_REST_UM.max(SYSTEMATIC * left_um);
        self.deviations_um.fill(deviation_um);
        self.nearest()
    }

    /// The plate that leaves least of what was measured, as far from the former calibration's as that is worth.
    fn nearest(&self) -> Option<Found> {
        let start = DVector::zeros(self.unknowns());
        let options = Options {
            bounds: Some(self.bounds()),
            prior: Some(Prior::around(start.clone(), 1.0)),
            cost_tolerance: TOLERANCE,
            step_tolerance: TOLERANCE,
            max_evaluations: MOST_EVALUATIONS,
            ..Options::default()
        };
        let solution = minimise(self, &start, &options).ok()?;
        let mut found = self.found(&solution.parameters);
        found.count_from_level();
        Some(found)
    }

    fn unknowns(&self) -> usize {
        CHANNELS * (TERMS + 3 + 1) + self.poles.len() + 3
    }

    /// In standard deviations from the former calibration.
    fn found(&self, coordinates: &DVector<f64>) -> Found {
        let mut values = coordinates.iter().copied();
        let mut next = || values.next().expect("as many coordinates as unknowns");
        let shapes = std::array::from_fn(|_| std::array::from_fn(|_| SHAPE * next()));
        let shares = self.shares.map(|share| share + SHARE * next());
        let more_growth = std::array::from_fn(|_| GROWTH_PER_K * next());
        let mut more_shared = [0.0; POLES];
        for (k, _) in &self.poles {
            more_shared[*k] = SHARED * next();
        }
        Found {
            shapes,
            shares,
            more_shared,
            more_growth,
            zero_um: Vector3::from_fn(|_, _| ZERO_UM * next()),
        }
    }

    /// Parts from none to all, and losses as a board takes them.
    fn bounds(&self) -> Bounds {
        const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
        let free = [FREE; CHANNELS * (TERMS + 3)];
        let growth = |growth: &f64| ((LEAST_GROWTH_PER_K - growth) / GROWTH_PER_K).min(0.0);
        let growths = self.growths.iter().map(|it| (growth(it), f64::INFINITY));
        let parts = self
            .poles
            .iter()
            .map(|(_, shared)| (-shared / SHARED, (1.0 - shared) / SHARED));
        Bounds::new(
            free.into_iter()
                .chain(growths)
                .chain(parts)
                .chain([FREE; 3]),
        )
    }

    /// What an instrument reads where the actuators take the plate by what was found.
    fn predicted_um(&self, found: &Found, places: &[Place; CHANNELS]) -> Vector3<f64> {
        let taken = std::array::from_fn::<_, CHANNELS, _>(|i| {
            let rise = places[i].rise(&found.more_shared, found.more_growth[i]);
            let place = self.tables[i].position_um(rise) / self.top_um;
            found.shape_um(i, place, self.top_um)
        });
        found.shares * Vector4::from(taken) - found.zero_um
    }

    /// What is left of the coordinates at each rest (um).
    fn left_at_rest_um(&self, found: &Found) -> impl Iterator<Item = Vector3<f64>> {
        let points = self.places.iter().zip(&self.reached_um);
        let rests = points.zip(&self.are_rests);
        rests
            .filter(|(_, is_rest)| **is_rest)
            .map(|((places, reached), _)| reached - self.predicted_um(found, places))
    }

    /// Root mean squares at rest, of the piston and of the tilts (um).
    pub(super) fn rms_um(&self, found: &Found) -> (f64, f64) {
        let (mut count, mut piston, mut tilts) = (0.0, 0.0, 0.0);
        for left in self.left_at_rest_um(found) {
            count += 1.0;
            piston += left.x * left.x;
            tilts += 0.5 * (left.y * left.y + left.z * left.z);
        }
        (f64::sqrt(piston / count), f64::sqrt(tilts / count))
    }
}

impl Problem for PlateFit {
    fn residuals(&self, coordinates: &DVector<f64>) -> Option<DVector<f64>> {
        let found = self.found(coordinates);
        let points = self.places.iter().zip(&self.reached_um);
        let left = points
            .zip(&self.deviations_um)
            .flat_map(|((places, reached), um)| {
                let left = (self.predicted_um(&found, places) - reached) / *um;
                [left.x, left.y, left.z]
            });
        let left = DVector::from_iterator(3 * self.places.len(), left);
        left.iter().all(|it| it.is_finite()).then_some(left)
    }

    fn difference_step(&self) -> DifferenceStep {
        DifferenceStep::Absolute(DIFFERENCE)
    }
}

impl Found {
    /// Where an actuator is whose table says a place, as a part of the range (um).
    pub(super) fn shape_um(&self, actuator: usize, place: f64, top_um: f64) -> f64 {
        let terms: [f64; TERMS] = bend_terms(place);
        let products = terms.iter().zip(&self.shapes[actuator]);
        top_um * (place + products.map(|(term, part)| term * part).sum::<f64>())
    }

    /// The piston where all four tables say the same place (um).
    pub(super) fn piston_um(&self, place: f64, top_um: f64) -> f64 {
        let shares = self.shares.row(0);
        (0..CHANNELS)
            .map(|i| shares[i] * self.shape_um(i, place, top_um))
            .sum()
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
            self.rescale(i, 1.0 / scale[i]);
        }
    }

    /// Multiplies an actuator's positions; the first term is the place itself.
    fn rescale(&mut self, actuator: usize, factor: f64) {
        let [first, others @ ..] = &mut self.shapes[actuator];
        *first = factor * (1.0 + *first) - 1.0;
        others.iter_mut().for_each(|part| *part *= factor);
    }
}
