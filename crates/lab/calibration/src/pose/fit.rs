//! The fit of a plate on four actuators to poses: shapes, shares, what the actuators share of their heat, what a watt is worth to each and how
//! its loss grows, what resistances tell beside their curves and of the others' heat, and where the instrument's zero is.

use std::cell::RefCell;
use std::rc::Rc;

use control_core::calibration::{FASTEST_SHARED, Lag, Parts};
use control_core::shape::SEGMENTS;
use control_core::{CHANNELS, Micrometre, PlateInverse, Pose};
use least_squares::{Bounds, DifferenceStep, Options, Prior, Problem, minimise};
use nalgebra::{DVector, Matrix3, Matrix3x4, Vector3, Vector4};

use super::heat::{Each, SharedHeat, level_rises, mean};
use super::history::History;
use super::late::Schedule;
use super::point::PosePoint;
use super::tables::{SensedCurve, Table, tables};
use crate::plate_pose::PlatePose;
use crate::refine::bend_terms;

/// Terms of what an actuator's shape is apart from its table. Over one that was bent by the mean of all four, that is smooth.
const TERMS: usize = 7;
/// Terms of what a resistance tells apart from its curve: a constant, a slope and a bend.
const BENDS: usize = 3;
/// How fast it tells more where its curve was only continued, over the place (K): of a tenth of the range 1 K, three times what the paper's
/// virtual mirror tells.
const FURTHER_K: f64 = 10.0;
/// And the same of how much further an actuator goes there: three times the 3 % that are told of what nobody tried.
const FURTHER: f64 = 0.1;
/// Standard deviations of what is sought, before anything was measured: a term of a shape, as a part of the range (that of a table that
/// nobody tried); a share, of which four make one piston; the shared part of a pole, which is anything from 0 to 1; the growth of the
/// loss (1/K), of which 3 % of a loss at some 60 K make 3e-4.
const SHAPE: f64 = 0.05;
const SHARE: f64 = 0.1;
const SHARED: f64 = 0.5;
const GROWTH_PER_K: f64 = 5e-4;
/// And the instrument's zero, the plate's rest when it was read (um): hysteresis leaves a mirror that was moved off the rest of one that never
/// was, the paper's virtual mirror by 0.3 um. Its actuators come down to rest together, and are left off it alike but for what they differ by.
const ZERO_UM: f64 = 0.5;
pub(super) const ZERO_TILT_UM: f64 = ZERO_UM * GAIN;
/// Least growth of a loss (1/K): what a board takes. One that falls with the rise stands for an actuator that loses less than the others.
const LEAST_GROWTH_PER_K: f64 = -1e-3;
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
/// Standard deviation of what a heater tells at rest (K): as much as the core takes the curve of a sound one to be off by
/// (`control_core::surroundings`). That much, too, a curve of level plates may be off by, and bend, where its four heaters share another power.
const TOLD_K: f64 = 0.2;
/// That of what it tells of the others' heat beyond what the bend sees of it, in kelvins for each: virtual mirrors have -0.031 to 0.005.
const SENSED_CROSSTALK: f64 = 0.05;
/// And that of the room where poses are measured, over that of the calibration before (K): 10 to 40 degC around a laboratory's 22.
const ROOM_K: f64 = 15.0;
/// What a watt is worth to an actuator, and how slow it is, as a part: what actuators differ by in their loss, twice that of a usual scatter of
/// 3 %. Five times it is no mirror's.
const GAIN: f64 = 0.06;
const MOST_GAINS: f64 = 5.0;
/// By how much an instrument tells late what it reads (s): a filter of some hundred hertz, and by how much a way comes late that the core
/// shapes for the plate's resonance.
const LATE_S: f64 = 1e-3;

/// What was measured, under a calibration.
pub(super) struct PlateFit {
    pub(super) top_um: f64,
    /// Mean distance of the levers from the centre under the former calibration (um). Tilts are multiplied by it, so that all three
    /// coordinates are in micrometres.
    pub(super) lever_um: f64,
    pub(super) tables: [Table; CHANNELS],
    pub(super) heat: SharedHeat,
    history: History,
    schedule: Schedule,
    /// What was read, in the order of the points.
    read: Vec<Read>,
    deviations_um: Vec<f64>,
    /// What each actuator's position adds to the coordinates under the former calibration (um/um).
    shares: Matrix3x4<f64>,
    /// The time constant with which a step of all own poles begins (s).
    initial_time_s: f64,
    /// What the resistances told of the others' heat under the former calibration (K/K).
    sensed_crosstalk: f64,
    /// Poles that may be shared.
    poles: Vec<usize>,
    /// The place up to which the calibration was tried; 1 where it was nowhere.
    tried: f64,
    /// What the resistances tell at equal steps of the rises; `None` where that is not known of all.
    curves: Option<[SensedCurve; CHANNELS]>,
    /// Where the actuators were under the heat that was asked for last: most of what is sought changes no heat.
    last: RefCell<Option<(SharedHeat, Rc<[Each]>)>>,
}

/// A point that was read.
struct Read {
    /// Its number.
    point: usize,
    reached_um: Vector3<f64>,
    is_rest: bool,
    told_k: Option<Each>,
}

/// What is sought.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Coefficients of what each actuator's shape is apart from its table, as parts of the range.
    shapes: [[f64; TERMS]; CHANNELS],
    /// By how much more it goes for each part of the range beyond what was tried.
    further: Each,
    /// What each actuator's position adds to the coordinates (um/um).
    pub(super) shares: Matrix3x4<f64>,
    /// How they share and lose their heat.
    pub(super) heat: SharedHeat,
    /// By how much warmer the room was where they were read than where the curves of the resistances were (K).
    room_k: f64,
    /// What each resistance tells apart from its curve (K): by powers of the place from 0 up.
    bends_k: [[f64; BENDS]; CHANNELS],
    /// What it tells more beyond the place up to which the calibration was tried (K), by the place.
    further_k: Each,
    /// That place.
    tried: f64,
    /// What each tells more for each kelvin by which the four are warmer in the mean (K/K).
    pub(super) sensed_crosstalk: f64,
    /// The coordinates at which what was measured is zero (um).
    pub(super) zero_um: Vector3<f64>,
    /// By how much the instrument tells late what it reads (s).
    late_s: f64,
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
        let poles = parts.heat.poles().into_iter();
        let may_be_shared = |(k, pole): (usize, Lag)| {
            let is_a_frames =
                k > 0 && pole.time.0 >= FASTEST_SHARED.0 && f64::from(pole.weight) >= LEAST_WEIGHT;
            is_a_frames.then_some(k)
        };
        let read: Vec<Read> = points
            .iter()
            .enumerate()
            .filter_map(|(number, point)| {
                Some(Read {
                    point: number,
                    reached_um: coordinates(point.reached.as_ref()?),
                    is_rest: point.is_rest(),
                    told_k: point.told_k.filter(|_| point.is_rest()),
                })
            })
            .collect();
        let deviation = |read: &Read| match read.is_rest {
            true => AT_REST_UM,
            false => ON_THE_WAY_UM,
        };
        let are_known = parts.actuators.iter().all(|it| it.sensed_rises.is_known());
        let curves = parts.actuators.each_ref().map(SensedCurve::of);
        Self {
            top_um: f64::from(top.0),
            lever_um,
            tables: tables(parts),
            sensed_crosstalk: f64::from(parts.sensed_crosstalk),
            initial_time_s: SharedHeat::of(parts).initial_time_s(),
            heat: SharedHeat::of(parts),
            history: History::new(parts, points),
            schedule: Schedule::of(points),
            deviations_um: read.iter().map(deviation).collect(),
            read,
            shares,
            tried: match parts.residual.is_tried() {
                true => f64::from(parts.residual.tried.0 / top.0),
                false => 1.0,
            },
            poles: poles.enumerate().filter_map(may_be_shared).collect(),
            curves: are_known.then_some(curves),
            last: RefCell::default(),
        }
    }

    /// The best plate near the former calibration's; `None` where there is none.
    pub(super) fn best(&mut self) -> Option<Found> {
        let found = self.nearest()?;
        if self.read.iter().any(|read| !read.is_rest) {
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
        let unchanged = DVector::zeros(self.unknowns());
        let mut parameters = unchanged.clone();
        // While shared heat is not known, losses and gains would stand for it.
        for free in [false, true] {
            let options = Options {
                bounds: Some(self.bounds(free)),
                prior: Some(Prior::around(unchanged.clone(), 1.0)),
                cost_tolerance: TOLERANCE,
                step_tolerance: TOLERANCE,
                max_evaluations: MOST_EVALUATIONS,
                ..Options::default()
            };
            parameters = minimise(self, &parameters, &options).ok()?.parameters;
        }
        let mut found = self.found(&parameters);
        found.count_from_level();
        Some(found)
    }

    fn unknowns(&self) -> usize {
        CHANNELS * (TERMS + 3 + 1 + 1 + BENDS + 1 + 2) + self.poles.len() + 3 + 1 + 1 + 1
    }

    /// In standard deviations from the former calibration.
    fn found(&self, coordinates: &DVector<f64>) -> Found {
        let mut values = coordinates.iter().copied();
        let mut next = || values.next().expect("as many coordinates as unknowns");
        let shapes = std::array::from_fn(|_| std::array::from_fn(|_| SHAPE * next()));
        let shares = self.shares.map(|share| share + SHARE * next());
        let mut heat = self.heat.clone();
        for growth in &mut heat.growths {
            *growth += GROWTH_PER_K * next();
        }
        for k in &self.poles {
            heat.shared[*k] += SHARED * next();
        }
        let zero_um = Vector3::new(ZERO_UM, ZERO_TILT_UM, ZERO_TILT_UM).map(|um| um * next());
        let room_k = ROOM_K * next();
        let bends_k = std::array::from_fn(|_| std::array::from_fn(|_| TOLD_K * next()));
        let further = std::array::from_fn(|_| FURTHER * next());
        let further_k = std::array::from_fn(|_| FURTHER_K * next());
        let more: Each = std::array::from_fn(|_| GAIN * next());
        let in_common = mean(&more);
        heat.gains = more.map(|more| 1.0 + more - in_common);
        // What they have in common the poles say.
        let slower: Each = std::array::from_fn(|_| GAIN * next());
        let in_common = mean(&slower);
        for (slower_s, more) in heat.slower_s.iter_mut().zip(slower) {
            *slower_s += (more - in_common) * self.initial_time_s;
        }
        let late_s = LATE_S * next();
        let sensed_crosstalk = self.sensed_crosstalk + SENSED_CROSSTALK * next();
        Found {
            shapes,
            further,
            shares,
            heat,
            zero_um,
            room_k,
            bends_k,
            further_k,
            tried: self.tried,
            sensed_crosstalk,
            late_s,
        }
    }

    /// Parts from none to all, and losses as a board takes them; these, what a watt is worth and how slow they are, are as before unless they are `free`.
    fn bounds(&self, free: bool) -> Bounds {
        const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
        /// In standard deviations: nothing.
        const HARDLY: f64 = 1e-9;
        let open = |low: f64, high: f64| match free {
            true => (low, high),
            false => (-HARDLY, HARDLY),
        };
        let growth = |growth: &f64| {
            let least = ((LEAST_GROWTH_PER_K - growth) / GROWTH_PER_K).min(-HARDLY);
            open(least, f64::INFINITY)
        };
        let parts = self.poles.iter().map(|k| {
            let shared = self.heat.shared[*k];
            (-shared / SHARED, (1.0 - shared) / SHARED)
        });
        Bounds::new(
            [ANY; CHANNELS * (TERMS + 3)]
                .into_iter()
                .chain(self.heat.growths.iter().map(growth))
                .chain(parts)
                .chain([ANY; 3 + 1 + CHANNELS * (BENDS + 2)])
                .chain([open(-MOST_GAINS, MOST_GAINS); 2 * CHANNELS])
                .chain([ANY; 2]),
        )
    }

    /// Where the tables say that the actuators were at each point (um).
    fn places_um(&self, heat: &SharedHeat) -> Rc<[Each]> {
        let mut last = self.last.borrow_mut();
        match &*last {
            Some((of, places)) if of == heat => places.clone(),
            _ => {
                let places = self.computed_places_um(heat);
                *last = Some((heat.clone(), places.clone()));
                places
            }
        }
    }

    fn computed_places_um(&self, heat: &SharedHeat) -> Rc<[Each]> {
        let tables = self.tables_under(heat);
        let rises = self.history.rises(heat).into_iter();
        rises
            .map(|rises| std::array::from_fn(|i| tables[i].position_um(rises[i])))
            .collect()
    }

    /// The tables, which keep what they say of a level plate at rest.
    fn tables_under(&self, heat: &SharedHeat) -> [Table; CHANNELS] {
        let before = (&self.heat, &self.tables);
        let rises: Vec<Each> = (0..=SEGMENTS)
            .map(|step| self.top_um * step as f64 / SEGMENTS as f64)
            .map(|um| level_rises(before, heat, um))
            .collect();
        std::array::from_fn(|i| Table::new(self.top_um, rises.iter().map(|it| it[i]).collect()))
    }

    /// What an instrument reads at a point, where the tables say that the actuators were at these places.
    fn predicted_um(&self, found: &Found, read: &Read, places_um: &[Each]) -> Vector3<f64> {
        let at = |point: usize| self.plate_um(found, &places_um[point]);
        let plate_um = match read.is_rest {
            true => at(read.point),
            false => self.schedule.before(read.point, found.late_s, at),
        };
        plate_um - found.zero_um
    }

    /// Where the plate is with the actuators at these places by their tables.
    fn plate_um(&self, found: &Found, places_um: &Each) -> Vector3<f64> {
        let taken = std::array::from_fn::<_, CHANNELS, _>(|i| {
            found.shape_um(i, places_um[i] / self.top_um, self.top_um)
        });
        found.shares * Vector4::from(taken)
    }

    /// What resistances that told this at rest are off by, in deviations; none where none are known.
    fn told_off(&self, found: &Found, read: &Read, places_um: &Each) -> Option<Each> {
        let (told_k, curves) = (read.told_k?, self.curves.as_ref()?);
        let rises: Each = std::array::from_fn(|i| self.tables[i].rise(places_um[i]));
        let mean_k = mean(&rises);
        Some(std::array::from_fn(|i| {
            let (told, slope) = curves[i].at(rises[i]);
            let of_others = found.sensed_crosstalk * (mean_k - rises[i]);
            let more = found.room_k + found.told_more_k(i, places_um[i] / self.top_um) + of_others;
            (told + more - told_k[i]) / (slope * TOLD_K)
        }))
    }

    /// What is left of the coordinates at each rest (um), with the number of its point.
    pub(super) fn left_at_rest_um(&self, found: &Found) -> Vec<(usize, Vector3<f64>)> {
        let places = self.places_um(&found.heat);
        let rests = self.read.iter().filter(|read| read.is_rest);
        rests
            .map(|read| {
                let left_um = read.reached_um - self.predicted_um(found, read, &places);
                (read.point, left_um)
            })
            .collect()
    }

    /// Root mean squares at rest, of the piston and of the tilts (um).
    pub(super) fn rms_um(&self, found: &Found) -> (f64, f64) {
        let (mut count, mut piston, mut tilts) = (0.0, 0.0, 0.0);
        for (_, left) in self.left_at_rest_um(found) {
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
        let places = self.places_um(&found.heat);
        let mut all = Vec::with_capacity((3 + CHANNELS) * self.read.len());
        for (read, um) in self.read.iter().zip(&self.deviations_um) {
            let left = (self.predicted_um(&found, read, &places) - read.reached_um) / *um;
            all.extend([left.x, left.y, left.z]);
        }
        let told_off = |read: &Read| self.told_off(&found, read, &places[read.point]);
        all.extend(self.read.iter().filter_map(told_off).flatten());
        let left = DVector::from_vec(all);
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
        let further = self.further[actuator] * (place - self.tried).max(0.0);
        top_um * (place + further + products.map(|(term, part)| term * part).sum::<f64>())
    }

    /// What an actuator's resistance tells more than its curve in the same room, at a place as a part of the range (K).
    fn told_more_k(&self, actuator: usize, place: f64) -> f64 {
        self.bend_k(actuator, place) + self.told_further_k(actuator, place)
    }

    /// The same, less what all four have in common, which may be the room's where the curves were tried.
    pub(super) fn told_apart_k(&self, actuator: usize, place: f64) -> f64 {
        let all = std::array::from_fn(|i| self.bend_k(i, place));
        all[actuator] - mean(&all) + self.told_further_k(actuator, place)
    }

    fn bend_k(&self, actuator: usize, place: f64) -> f64 {
        let [constant, slope, bend] = self.bends_k[actuator];
        constant + place * (slope + place * bend)
    }

    /// Where its curve was only continued.
    fn told_further_k(&self, actuator: usize, place: f64) -> f64 {
        self.further_k[actuator] * (place - self.tried).max(0.0)
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
        self.further[actuator] *= factor;
    }
}
