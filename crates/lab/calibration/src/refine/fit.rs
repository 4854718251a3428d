//! The fit of all stages to a session, by variable projection (Golub and Pereyra 1973): in every trial of the unknowns that
//! enter nonlinearly, the others are the solution of a linear problem.

use control_core::CHANNELS;
use control_core::calibration::{Parts, Resonance, SensedRises};
use least_squares::{Options, minimise};

use super::films::Films;
use super::heat::HeatLoss;
use super::linear::{Displacements, LinearStages};
use super::projection::{Estimate, Forward, Projection, residuals};
use super::resistance::Line;
use super::thermal::Thermal;
use super::timeline::{TimeStep, Timeline};
use super::unknowns::Unknowns;
use super::{sensed, springs};

/// How often memory's own input is brought up to date with what was found. Memory is some percent of the displacement, so its
/// error falls by as much each time: where creep comes to 15 % the fourth changes the sum of squares by a thousandth.
const ROUNDS: usize = 4;
/// A fit ends where a step gains, or moves, no more than this share: a choice, far below what noise leaves open. As long as memory's
/// input is off by more, so may the fit be.
const TOLERANCE: f64 = 1e-6;
const ROUGH: f64 = 1e-4;
/// A mirror is followed where the mean square of the displacement's standardised residuals is less than this: some two deviations. Of
/// usual mirrors 4.5 were measured at most, of the paper's; of fast, creeping and slow ones 6.6, 17 and 50 and more (`bench foreign`, seeds
/// 904, 903 and 902).
pub(super) const FOLLOWED: f64 = 5.0;
/// Films are unusual where that leaves so small a part of the squares: foreign mirrors, whose films are usual, are left nine tenths and more (`bench
/// foreign`, seeds 901 to 904), another author's, whose films moved by 1.6 um when they were hot for the first time, a quarter.
const UNUSUAL_LEAVE: f64 = 0.5;
/// Evaluations of a fit: seven steps for each of the 22 unknowns.
const MOST_EVALUATIONS: usize = 150;

/// What was measured, and the calibration that it was measured under.
pub(super) struct StagesFit {
    pub(super) thermal: Thermal,
    /// The same session, where fast ways bear little weight: they tell poles, but would bend what holds the mirror at rest.
    slow: Timeline,
    /// What the plate does on its springs.
    resonance: Resonance,
}

/// The stages that were found.
pub(super) struct Fitted {
    pub(super) unknowns: Unknowns,
    pub(super) losses: [HeatLoss; CHANNELS],
    pub(super) linear: LinearStages,
    /// Sum of squares of the standardised residuals.
    cost: f64,
    /// Their mean square where they are of the displacement.
    mean_square: f64,
    /// Root mean square of the residuals, weighted by their variances.
    pub(super) residual_rms_um: f64,
}

impl Fitted {
    /// Whether the stages follow the mirror about as closely as their readings' standard deviations say.
    pub(super) fn follows(&self) -> bool {
        self.mean_square < FOLLOWED
    }
}

impl StagesFit {
    pub(super) fn new(parts: &Parts, timeline: Timeline, slow: Timeline) -> Self {
        Self {
            thermal: Thermal::new(parts, timeline),
            slow,
            resonance: parts.path.resonance,
        }
    }

    /// The best stages of the fits from several starts; `None` where none leads anywhere. Unusual films are tried where usual ones leave a mean square
    /// of more than `most`.
    pub(super) fn best(
        &self,
        most: f64,
        starts: impl IntoIterator<Item = Unknowns>,
    ) -> Option<Fitted> {
        let starts = starts.into_iter();
        let fits = starts.filter_map(|start| self.from(Films::Usual, start));
        let usual = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        if usual.mean_square < most {
            return Some(usual);
        }
        let unusual = self.from(Films::Unusual, usual.unknowns);
        unusual
            .filter(|unusual| unusual.cost < UNUSUAL_LEAVE * usual.cost)
            .or(Some(usual))
    }

    /// The best stages near a start.
    fn from(&self, films: Films, start: Unknowns) -> Option<Fitted> {
        let options = |tolerance: f64| Options {
            bounds: Some(Unknowns::bounds(&self.thermal.losses, films)),
            prior: Some(start.prior()),
            cost_tolerance: tolerance,
            step_tolerance: tolerance,
            max_evaluations: MOST_EVALUATIONS,
            ..Options::default()
        };
        let mut at = start.coordinates();
        let places_um = self.thermal.places_um(&start, &self.thermal.rises(&start));
        let mut estimate = Estimate {
            held: self.held(&self.thermal.timeline, &places_um),
            memory: Displacements::without_memory(&places_um),
            films,
        };
        let mut fitted = None;
        for round in 1..=ROUNDS {
            let tolerance = if round < ROUNDS { ROUGH } else { TOLERANCE };
            let projection = Projection::new(&self.thermal, &estimate);
            at = minimise(&projection, &at, &options(tolerance))
                .ok()?
                .parameters;
            let unknowns = Unknowns::at(&at);
            let forward = projection.forward(&unknowns)?;
            let residuals = residuals(&estimate.held, &forward);
            let squares = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
            let cost = squares(&residuals);
            let readings = self.thermal.timeline.readings();
            let mean_square = squares(&residuals[..readings]) / readings as f64;
            let residual_rms_um = weighted_rms_um(&estimate.held, &forward);
            let Forward {
                heated,
                memory,
                linear,
            } = forward;
            let places_um = &heated.places_um;
            let now_um: Vec<f64> = linear.predict(places_um, &memory).collect();
            estimate = Estimate {
                held: self.held(&self.thermal.timeline, &now_um),
                memory: linear.displacements(places_um, &memory),
                films,
            };
            let held = self.held(&self.slow, &now_um);
            fitted = Some(Fitted {
                losses: unknowns.losses(&self.thermal.losses),
                unknowns,
                linear: LinearStages::fit(&held, self.thermal.top_um, places_um, &memory, films)?,
                cost,
                mean_square,
                residual_rms_um,
            });
        }
        fitted
    }

    /// Time steps whose readings are without what the plate on its springs adds where its actuators hold it so (um).
    fn held(&self, timeline: &Timeline, held_um: &[f64]) -> Vec<TimeStep> {
        let mut steps = timeline.steps.clone();
        let added = springs::added_um(&self.resonance, &steps, held_um.iter().copied());
        for (step, added_um) in steps.iter_mut().zip(added) {
            if let Some(read) = &mut step.displacement {
                read.z_um -= added_um;
            }
        }
        steps
    }

    /// What each actuator's resistance, read by its line, tells where the mirror rests, up to these rises (K).
    pub(super) fn sensed_rises(
        &self,
        fitted: &Fitted,
        lines: &[Option<Line>; CHANNELS],
        tops_k: [f64; CHANNELS],
    ) -> [Option<SensedRises>; CHANNELS] {
        let steps = &self.thermal.timeline.steps;
        let rises = self.thermal.rises(&fitted.unknowns);
        std::array::from_fn(|channel| {
            let line = lines[channel]?;
            let mut excursion = sensed::Excursion::default();
            let read = |(step, rises): (&TimeStep, &[(f64, f64); CHANNELS])| {
                let (rise, unsettled) = rises[channel];
                let moved = excursion.moved(rise, step.duration_s);
                let read = step.sensed[channel]?;
                Some(sensed::Reading {
                    rise,
                    unsettled,
                    moved,
                    sensed: (read.ohm - line.cold_ohm) / line.ohm_per_k,
                    volts: read.volts,
                })
            };
            let readings = steps.iter().zip(&rises).filter_map(read);
            sensed::through(readings, tops_k[channel])
        })
    }

    /// The temperature rises of the actuators at the end of every time step, with each step's sensed resistances.
    pub(super) fn resistances(&self, fitted: &Fitted) -> [Option<Line>; CHANNELS] {
        let network = &fitted.unknowns.network;
        let rises = network.rises(&self.thermal.timeline.steps, &fitted.losses);
        std::array::from_fn(|channel| {
            let steps = self.thermal.timeline.steps.iter().zip(&rises);
            Line::through(
                steps.filter_map(|(step, rise)| Some((rise[channel], step.sensed[channel]?))),
            )
        })
    }
}

/// Root mean square of what is left of the displacement, weighted by the readings' variances (um).
fn weighted_rms_um(held: &[TimeStep], forward: &Forward) -> f64 {
    let steps = held.iter().zip(forward.displacements_um());
    let (mut squares, mut weights) = (0.0, 0.0);
    for (step, z_um) in steps {
        if let Some(read) = step.displacement {
            let weight = read.standard_deviation_um.powi(-2);
            squares += weight * (z_um - read.z_um).powi(2);
            weights += weight;
        }
    }
    (squares / weights).sqrt()
}
