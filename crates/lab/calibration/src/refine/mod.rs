//! A calibration's stages refined by what a mirror did.
//!
//! The model says which physics there is, with few numbers; the core's stages hold more than these, and a mirror of
//! distributed heat and several memories has more. Beginning with the model's, the thermal poles and the growth of the
//! heat loss are fitted to the displacement by Levenberg and Marquardt, and in each of their trials the rest by linear
//! least squares: a smooth bend of the tables, plays and creep. Heating is the power that the currents tell, so memory is
//! not taken for heat; what they tell of resistance makes the heaters' own lines. Plays let go while nothing moves: a drive
//! that trembles by its own rounding loosens friction.

mod course;
mod heat;
mod memory;
mod resistance;

use control_core::calibration::{FAST_POLES, Parts, SLOW};
use control_core::shape::{KNOTS, SEGMENTS};
use control_core::{
    ActuatorCalibration, CHANNELS, Calibration, CalibrationError, InverseTable, Kelvin, Micrometre,
    Ohm, PerKelvin,
};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use measurement::Session;
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use self::course::Course;
use self::heat::{Loss, POLES, Poles};
use self::memory::{Displaced, Linear, Memories};
use self::resistance::Line;
use crate::curve::Curve;

/// Fewer readings than this refine nothing.
const FEWEST: usize = 200;
/// How often the memory's own history is brought up to date with what was found.
const ROUNDS: usize = 3;
/// Where fits start besides the model's own poles: weights and times (s) of a mirror in its package.
const USUAL: [(f64, f64); POLES] = [
    (0.5, 1e-3),
    (0.3, 0.03),
    (0.1, 0.15),
    (0.01, 0.7),
    (0.05, 4.0),
];
/// The weight that a pole starts with of which the model knows nothing.
const UNKNOWN: f64 = 5e-3;
/// Stages that leave more than this part of the range follow nothing.
const FOLLOWS: f64 = 0.02;
/// Fastest and slowest pole (s).
const FASTEST_S: f64 = 1e-4;
const SLOWEST_S: f64 = 60.0;
/// A prior so wide keeps the logarithms near their start where the data do not determine them.
const PRIOR: f64 = 3.0;
/// Unit in which the growth of the heat loss is fitted (1/K).
const GROWTH: f64 = 1e-3;
/// Difference step of the derivatives.
const DIFFERENCE: f64 = 1e-4;
/// Fastest and slowest release of the plays (s); fits start at 1 s, whose logarithm is 0.
const RELEASE_S: (f64, f64) = (0.02, 1e4);
/// What is fitted: times, weights, growth, release.
const UNKNOWNS: usize = 2 * POLES + 2;

/// A refined calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// What a board needs.
    pub calibration: Calibration,
    /// Root mean square of what its stages leave of the displacement, ringing left out (um).
    pub residual_rms_um: f64,
}

/// Why nothing was refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// Too few readings.
    #[error(
        "{0} readings of displacement close to a known drive are too few to refine a calibration; measure steps, read densely"
    )]
    TooFew(usize),
    /// Nothing follows the readings.
    #[error(
        "no stages follow what was measured; look whether the sensor sees the mirror, and whether currents were recorded"
    )]
    NoFit,
    /// The bent table is none.
    #[error("the refined calibration cannot be used: {0}")]
    Calibration(#[from] CalibrationError),
}

/// `calibration` with its stages refined by a session.
///
/// Only rows whose heating is known count: along a smooth drive, and after a jump of it when they come soon enough.
///
/// # Errors
/// Where too little was measured, or no stages follow it.
pub fn refined(calibration: &Calibration, session: &Session) -> Result<Refined, RefineError> {
    let parts = calibration.parts();
    let course = Course::of(session, f64::from(parts.path.move_time.0));
    if course.seen() < FEWEST {
        return Err(RefineError::TooFew(course.seen()));
    }
    let mirror = Mirror::new(parts, &course);
    let own = Poles::of(&parts.heat);
    let found = [start(&own), start(&usual())].map(|start| mirror.search(start));
    let best = found
        .into_iter()
        .flatten()
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .filter(|best| best.rms_um < FOLLOWS * mirror.top_um)
        .ok_or(RefineError::NoFit)?;
    mirror.refined(parts, &best)
}

fn usual() -> Poles {
    Poles {
        weight: USUAL.map(|(weight, _)| weight),
        time_s: USUAL.map(|(_, time_s)| time_s),
    }
}

/// Logarithms of times and weights; a pole that is not there starts at its usual place, with little weight.
fn start(poles: &Poles) -> DVector<f64> {
    let mut at = DVector::zeros(UNKNOWNS);
    for (k, (_, usual_s)) in USUAL.into_iter().enumerate() {
        let known = poles.weight[k] > UNKNOWN;
        at[k] = if known {
            poles.time_s[k].max(FASTEST_S)
        } else {
            usual_s
        }
        .ln();
        at[POLES + k] = if known { poles.weight[k] } else { UNKNOWN }.ln();
    }
    at
}

/// What was measured, and the calibration that it is measured by.
struct Mirror<'a> {
    course: &'a Course,
    top_um: f64,
    losses: [Loss; CHANNELS],
    /// The tables read forward.
    shapes: [Curve; CHANNELS],
}

/// The stages at one trial of the unknowns.
struct Stages {
    poles: Poles,
    losses: [Loss; CHANNELS],
    /// Time in which the plays let go (s).
    release_s: f64,
}

/// The best that was found from one start.
struct Found {
    stages: Stages,
    linear: Linear,
    cost: f64,
    rms_um: f64,
}

impl<'a> Mirror<'a> {
    fn new(parts: &Parts, course: &'a Course) -> Self {
        let losses = parts.actuators.each_ref().map(|lane| Loss {
            k_per_w: f64::from(lane.thermal_resistance.0),
            growth: f64::from(lane.loss_growth.0),
        });
        Self {
            course,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            losses,
            shapes: parts.actuators.each_ref().map(|lane| {
                let (positions, rises) = knots(lane);
                Curve::new(rises, positions).expect("a table rises, that is what it was made with")
            }),
        }
    }

    fn stages(&self, at: &DVector<f64>) -> Stages {
        let slow = f64::from(SLOW.0);
        let time_s = std::array::from_fn(|k| {
            let (low, high) = if k < FAST_POLES {
                (FASTEST_S, slow)
            } else {
                (slow, SLOWEST_S)
            };
            at[k].exp().clamp(low, high)
        });
        let weight: [f64; POLES] = std::array::from_fn(|k| at[POLES + k].clamp(-20.0, 20.0).exp());
        let whole: f64 = weight.iter().sum();
        Stages {
            poles: Poles {
                weight: weight.map(|weight| weight / whole),
                time_s,
            },
            losses: self.losses.map(|loss| Loss {
                growth: (loss.growth + GROWTH * at[2 * POLES]).clamp(0.0, 0.1),
                ..loss
            }),
            release_s: at[2 * POLES + 1].exp().clamp(RELEASE_S.0, RELEASE_S.1),
        }
    }

    /// The mean place of the four actuators in the tables as they were, moment by moment.
    fn places_um(&self, stages: &Stages) -> Vec<f64> {
        let rises = stages.poles.rises(&self.course.moments, &stages.losses);
        let place = |rises: [f64; CHANNELS]| {
            let place = |lane: usize| {
                // The same power under the loss that the table was made with.
                let heating = stages.losses[lane].heating(rises[lane]);
                self.shapes[lane].at(self.losses[lane].rise(heating))
            };
            (0..CHANNELS).map(place).sum::<f64>() / CHANNELS as f64
        };
        rises.into_iter().map(place).collect()
    }

    /// The best stages near a start.
    fn search(&self, start: DVector<f64>) -> Option<Found> {
        let mut at = start.clone();
        let mut roughly = Displaced::without_memory(&self.places_um(&self.stages(&at)));
        let mut found = None;
        for _ in 0..ROUNDS {
            let trial = Trial {
                mirror: self,
                roughly: &roughly,
                start: start.clone(),
                at,
            };
            let (trial, _) = LevenbergMarquardt::new()
                .with_ftol(1e-6)
                .with_xtol(1e-6)
                .with_patience(8)
                .minimize(trial);
            at = trial.at;
            let stages = self.stages(&at);
            let places = self.places_um(&stages);
            let memories = Memories::new(
                &self.course.moments,
                self.top_um,
                stages.release_s,
                &roughly,
            );
            let linear = Linear::fit(&self.course.moments, self.top_um, &places, &memories)?;
            roughly = linear.displaced(&places, &memories);
            let (cost, rms_um) = self.misfit(linear.predict(&places, &memories));
            found = Some(Found {
                stages,
                linear,
                cost,
                rms_um,
            });
        }
        found
    }

    /// The sum of squares in units of trust, and the weighted root mean square in um.
    fn misfit(&self, predicted: impl Iterator<Item = f64>) -> (f64, f64) {
        let (mut cost, mut weights) = (0.0, 0.0);
        for (moment, z) in self.course.moments.iter().zip(predicted) {
            if let Some((seen, trust)) = moment.seen_um {
                cost += ((seen - z) / trust).powi(2);
                weights += trust.powi(-2);
            }
        }
        (cost, (cost / weights).sqrt())
    }

    /// What the currents told of each heater.
    fn heaters(&self, stages: &Stages) -> [Option<Line>; CHANNELS] {
        let rises = stages.poles.rises(&self.course.moments, &stages.losses);
        std::array::from_fn(|lane| {
            let moments = self.course.moments.iter().zip(&rises);
            Line::through(
                moments.filter_map(|(moment, rise)| Some((rise[lane], moment.told[lane]?))),
            )
        })
    }

    fn refined(&self, parts: &Parts, found: &Found) -> Result<Refined, RefineError> {
        let places: Vec<f64> = (0..KNOTS)
            .map(|i| self.top_um * i as f64 / SEGMENTS as f64)
            .collect();
        let bent = places
            .iter()
            .map(|place| found.linear.bent(*place))
            .collect();
        let place_at = Curve::new(bent, places).map_err(|_| RefineError::NoFit)?;
        let top_um = found.linear.bent(self.top_um);
        let mut actuators = parts.actuators;
        let heaters = self.heaters(&found.stages);
        for ((lane, (was, is)), heater) in actuators
            .iter_mut()
            .zip(self.losses.iter().zip(&found.stages.losses))
            .zip(heaters)
        {
            let (positions, rises) = knots(lane);
            let rise_at =
                Curve::new(positions, rises).expect("a table rises, that is what it was made with");
            let mut knots = [0.0; KNOTS];
            for (i, knot) in knots.iter_mut().enumerate().skip(1) {
                let place = place_at.at(top_um * i as f64 / SEGMENTS as f64);
                *knot = is.rise(was.heating(rise_at.at(place))) as f32;
            }
            lane.loss_growth = PerKelvin(is.growth as f32);
            if let Some(heater) = heater {
                lane.cold_resistance = Ohm(heater.cold_ohm as f32);
                lane.tcr = PerKelvin((heater.ohm_per_k / heater.cold_ohm) as f32);
            }
            lane.shape = InverseTable::new(Micrometre(top_um as f32), knots)
                .map_err(CalibrationError::from)?;
        }
        let mut bounds = parts.bounds;
        let rise = |lane: usize| {
            let heating = self.losses[lane].heating(f64::from(parts.bounds.rise.0));
            found.stages.losses[lane].rise(heating)
        };
        bounds.rise = Kelvin((0..CHANNELS).map(rise).fold(0.0, f64::max) as f32);
        Ok(Refined {
            calibration: Calibration::new(Parts {
                actuators,
                heat: found.stages.poles.heat(),
                memory: found.linear.memory(found.stages.release_s),
                bounds,
                ..*parts
            })?,
            residual_rms_um: found.rms_um,
        })
    }
}

/// Positions and temperature rises of a lane's table.
fn knots(lane: &ActuatorCalibration) -> (Vec<f64>, Vec<f64>) {
    let top_um = f64::from(lane.shape.top().0);
    let position = |i: usize| top_um * i as f64 / SEGMENTS as f64;
    let rises = lane.shape.knots().iter().map(|rise| f64::from(*rise));
    ((0..KNOTS).map(position).collect(), rises.collect())
}

/// The unknowns, for the fitter.
struct Trial<'a> {
    mirror: &'a Mirror<'a>,
    roughly: &'a Displaced,
    start: DVector<f64>,
    at: DVector<f64>,
}

impl Trial<'_> {
    fn residuals_at(&self, at: &DVector<f64>) -> Option<DVector<f64>> {
        let mirror = self.mirror;
        let moments = &mirror.course.moments;
        let stages = mirror.stages(at);
        let places = mirror.places_um(&stages);
        let memories = Memories::new(moments, mirror.top_um, stages.release_s, self.roughly);
        let linear = Linear::fit(moments, mirror.top_um, &places, &memories)?;
        let predicted = moments.iter().zip(linear.predict(&places, &memories));
        let rows = predicted
            .filter_map(|(moment, z)| moment.seen_um.map(|(seen, trust)| (z - seen) / trust));
        let prior = at
            .iter()
            .zip(self.start.iter())
            .map(|(at, start)| (at - start) / PRIOR);
        Some(DVector::from_vec(rows.chain(prior).collect()))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Trial<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.clone_from(at);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.residuals_at(&self.at)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.residuals_at(&self.at)?;
        let columns: Option<Vec<_>> = (0..UNKNOWNS)
            .map(|k| {
                let mut at = self.at.clone();
                at[k] += DIFFERENCE;
                Some((self.residuals_at(&at)? - &here) / DIFFERENCE)
            })
            .collect();
        Some(DMatrix::from_columns(&columns?))
    }
}
