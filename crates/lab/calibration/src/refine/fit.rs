//! The fit of all stages to a session, by variable projection (Golub and Pereyra 1973): in every trial of the unknowns that
//! enter nonlinearly, the others are the solution of a linear problem.

use std::cell::RefCell;
use std::rc::Rc;

use control_core::CHANNELS;
use control_core::calibration::{Parts, Resonance, SensedRises};
use least_squares::{DifferenceStep, Options, Problem, minimise};
use nalgebra::DVector;

use super::heat::{HeatLoss, Lags};
use super::heaters;
use super::linear::{Displacements, LinearStages, MemoryTerms};
use super::resistance::Line;
use super::timeline::{TimeStep, Timeline};
use super::unknowns::Unknowns;
use super::{sensed, springs};
use crate::curve::Curve;

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
const FOLLOWED: f64 = 5.0;
/// Evaluations of a fit: seven steps for each of the 22 unknowns.
const MOST_EVALUATIONS: usize = 150;
/// Difference step of a coordinate: far above the rounding of thousands of time steps, and far below one.
const DIFFERENCE: f64 = 1e-4;

/// What was measured, and the calibration that it was measured under.
pub(super) struct StagesFit {
    timeline: Timeline,
    /// The same, where fast ways bear little weight: they tell poles, but would bend what holds the mirror at rest.
    slow: Timeline,
    /// Where the tables end.
    pub(super) top_um: f64,
    /// The heat losses that the tables were made with.
    pub(super) losses: [HeatLoss; CHANNELS],
    /// The tables read forward: temperature rise (K) to displacement (um).
    shapes: [Curve; CHANNELS],
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

/// Temperature rises of the beams, and what their heaters and fast poles have still to bring (K).
type Rises = [(f64, f64); CHANNELS];

/// What a round of the fit takes as known from the one before: readings without the plate's own motion, and what drives memory.
struct Estimate {
    held: Vec<TimeStep>,
    memory: Displacements,
}

/// The thermal stages forward, at the end of every time step.
struct Heated {
    places_um: Vec<f64>,
    /// Standardised residuals of the resistances.
    resistances: Vec<f64>,
}

/// All stages forward, at the end of every time step.
struct Forward {
    heated: Rc<Heated>,
    memory: Rc<MemoryTerms>,
    linear: LinearStages,
}

impl Forward {
    fn displacements_um(&self) -> impl Iterator<Item = f64> {
        self.linear.predict(&self.heated.places_um, &self.memory)
    }
}

/// What was computed last, and of which unknowns: most columns of a Jacobian change either heat or memory.
#[derive(Default)]
struct Last {
    heated: Option<(Unknowns, Rc<Heated>)>,
    memory: Option<(Unknowns, Rc<MemoryTerms>)>,
}

impl Last {
    /// What was kept, if it is of unknowns alike in what it depends on; else what `compute` makes.
    fn or_compute<T>(
        kept: &mut Option<(Unknowns, Rc<T>)>,
        unknowns: &Unknowns,
        are_alike: impl Fn(&Unknowns, &Unknowns) -> bool,
        compute: impl FnOnce() -> T,
    ) -> Rc<T> {
        if let Some((of, known)) = kept
            && are_alike(of, unknowns)
        {
            return known.clone();
        }
        let computed = Rc::new(compute());
        *kept = Some((*unknowns, computed.clone()));
        computed
    }
}

impl StagesFit {
    pub(super) fn new(parts: &Parts, timeline: Timeline, slow: Timeline) -> Self {
        let losses = parts.actuators.each_ref().map(|actuator| HeatLoss {
            k_per_w: f64::from(actuator.thermal_resistance.0),
            growth: f64::from(actuator.loss_growth.0),
        });
        Self {
            timeline,
            slow,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            losses,
            shapes: parts.actuators.each_ref().map(super::tables::forward),
            resonance: parts.path.resonance,
        }
    }

    /// The best stages of the fits from several starts; `None` where none leads anywhere.
    pub(super) fn best(&self, starts: impl IntoIterator<Item = Unknowns>) -> Option<Fitted> {
        let fits = starts.into_iter().filter_map(|start| self.from(start));
        fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// The best stages near a start.
    fn from(&self, start: Unknowns) -> Option<Fitted> {
        let options = |tolerance: f64| Options {
            bounds: Some(Unknowns::bounds(&self.losses)),
            prior: Some(start.prior()),
            cost_tolerance: tolerance,
            step_tolerance: tolerance,
            max_evaluations: MOST_EVALUATIONS,
            ..Options::default()
        };
        let mut at = start.coordinates();
        let places_um = self.places_um(&start, &self.rises(&start));
        let mut estimate = Estimate {
            held: self.held(&self.timeline, &places_um),
            memory: Displacements::without_memory(&places_um),
        };
        let mut fitted = None;
        for round in 1..=ROUNDS {
            let tolerance = if round < ROUNDS { ROUGH } else { TOLERANCE };
            let projection = Projection {
                fit: self,
                estimate: &estimate,
                last: RefCell::default(),
            };
            at = minimise(&projection, &at, &options(tolerance))
                .ok()?
                .parameters;
            let unknowns = Unknowns::at(&at);
            let forward = projection.forward(&unknowns)?;
            let residuals = residuals(&estimate.held, &forward);
            let squares = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
            let cost = squares(&residuals);
            let readings = self.timeline.readings();
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
                held: self.held(&self.timeline, &now_um),
                memory: linear.displacements(places_um, &memory),
            };
            let held = self.held(&self.slow, &now_um);
            fitted = Some(Fitted {
                losses: unknowns.losses(&self.losses),
                unknowns,
                linear: LinearStages::fit(&held, self.top_um, places_um, &memory)?,
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

    /// The rises of the beams, which follow their heaters, at the end of every time step, and what these and their fast poles have still to
    /// bring then (K).
    fn rises(&self, unknowns: &Unknowns) -> Vec<Rises> {
        let steps = &self.timeline.steps;
        let losses = unknowns.losses(&self.losses);
        let mut rises = unknowns.network.rises_unsettled(steps, &losses);
        let (mut before, mut beams) = ([0.0; CHANNELS], [0.0; CHANNELS]);
        let mut lags = Lags::of([unknowns.beam_lag_s]);
        for (step, rises) in steps.iter().zip(&mut rises) {
            let heaters = rises.map(|(rise, _)| rise);
            if step.duration_s > 0.0 {
                let [lag] = lags.over(step.duration_s);
                beams = std::array::from_fn(|i| lag.after(beams[i], before[i], heaters[i]));
                before = heaters;
            }
            for ((rise, unsettled), beam) in rises.iter_mut().zip(beams) {
                *unsettled += *rise - beam;
                *rise = beam;
            }
        }
        rises
    }

    /// The mean place of the four actuators in the tables as they were, at the end of every time step (um).
    fn places_um(&self, unknowns: &Unknowns, rises: &[Rises]) -> Vec<f64> {
        let losses = unknowns.losses(&self.losses);
        let mean = |rises: &Rises| {
            let place = |channel: usize| {
                // The rise of the same heating under the loss that the table was made with.
                let heating = losses[channel].heating(rises[channel].0);
                self.shapes[channel].at(self.losses[channel].rise(heating))
            };
            (0..CHANNELS).map(place).sum::<f64>() / CHANNELS as f64
        };
        rises.iter().map(mean).collect()
    }

    /// What each actuator's resistance, read by its line, tells where the mirror rests, up to these rises (K).
    pub(super) fn sensed_rises(
        &self,
        fitted: &Fitted,
        lines: &[Option<Line>; CHANNELS],
        tops_k: [f64; CHANNELS],
    ) -> [Option<SensedRises>; CHANNELS] {
        let rises = self.rises(&fitted.unknowns);
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
            let readings = self.timeline.steps.iter().zip(&rises).filter_map(read);
            sensed::through(readings, tops_k[channel])
        })
    }

    /// The temperature rises of the actuators at the end of every time step, with each step's sensed resistances.
    pub(super) fn resistances(&self, fitted: &Fitted) -> [Option<Line>; CHANNELS] {
        let network = &fitted.unknowns.network;
        let rises = network.rises(&self.timeline.steps, &fitted.losses);
        std::array::from_fn(|channel| {
            let steps = self.timeline.steps.iter().zip(&rises);
            Line::through(
                steps.filter_map(|(step, rise)| Some((rise[channel], step.sensed[channel]?))),
            )
        })
    }
}

/// The standardised residuals of all readings, predicted less measured: of the displacement, and of the resistances.
fn residuals(held: &[TimeStep], forward: &Forward) -> Vec<f64> {
    let steps = held.iter().zip(forward.displacements_um());
    let displacement = steps.filter_map(|(step, z_um)| {
        let read = step.displacement?;
        Some((z_um - read.z_um) / read.standard_deviation_um)
    });
    let resistances = forward.heated.resistances.iter().copied();
    displacement.chain(resistances).collect()
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

/// The residuals as a function of the nonlinear unknowns alone.
struct Projection<'a> {
    fit: &'a StagesFit,
    estimate: &'a Estimate,
    last: RefCell<Last>,
}

impl Projection<'_> {
    /// The stages forward with these unknowns and the linear stages that are best with them.
    fn forward(&self, unknowns: &Unknowns) -> Option<Forward> {
        let Estimate { held, memory } = self.estimate;
        let top_um = self.fit.top_um;
        let mut last = self.last.borrow_mut();
        let Last {
            heated: heated_last,
            memory: memory_last,
        } = &mut *last;
        let heated = Last::or_compute(heated_last, unknowns, Unknowns::heats_like, || {
            let rises = self.fit.rises(unknowns);
            Heated {
                places_um: self.fit.places_um(unknowns, &rises),
                resistances: heaters::residuals(held, &rises),
            }
        });
        let memory = Last::or_compute(memory_last, unknowns, Unknowns::remembers_like, || {
            MemoryTerms::new(held, top_um, unknowns, memory)
        });
        let linear = LinearStages::fit(held, top_um, &heated.places_um, &memory)?;
        Some(Forward {
            heated,
            memory,
            linear,
        })
    }
}

impl Problem for Projection<'_> {
    fn residuals(&self, coordinates: &DVector<f64>) -> Option<DVector<f64>> {
        let forward = self.forward(&Unknowns::at(coordinates))?;
        Some(DVector::from_vec(residuals(&self.estimate.held, &forward)))
    }

    fn difference_step(&self) -> DifferenceStep {
        DifferenceStep::Absolute(DIFFERENCE)
    }
}
