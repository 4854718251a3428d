//! The fit of all stages to a session, by variable projection (Golub and Pereyra 1973): in every trial of the unknowns that
//! enter nonlinearly, the others are the solution of a linear problem.

use control_core::CHANNELS;
use control_core::calibration::{Parts, SensedRises};
use least_squares::{DifferenceStep, Options, Problem, minimise};
use nalgebra::DVector;

use super::heat::HeatLoss;
use super::linear::{Displacements, LinearStages, MemoryTerms};
use super::resistance::Line;
use super::sensed;
use super::timeline::{TimeStep, Timeline};
use super::unknowns::Unknowns;
use crate::curve::Curve;

/// How often memory's own input is brought up to date with what was found. Memory is some percent of the displacement, so its
/// error falls by as much each time, and the third is of the order of the noise.
const ROUNDS: usize = 3;
/// A fit ends where a step gains, or moves, no more than this share: a choice, far below what noise leaves open.
const TOLERANCE: f64 = 1e-6;
/// Evaluations of a fit: a dozen steps for each of the twelve unknowns.
const MOST_EVALUATIONS: usize = 150;
/// Difference step of a coordinate: far above the rounding of thousands of time steps, and far below one.
const DIFFERENCE: f64 = 1e-4;

/// What was measured, and the calibration that it was measured under.
pub(super) struct StagesFit<'a> {
    timeline: &'a Timeline,
    /// Where the tables end.
    pub(super) top_um: f64,
    /// The heat losses that the tables were made with.
    pub(super) losses: [HeatLoss; CHANNELS],
    /// The tables read forward: temperature rise (K) to displacement (um).
    shapes: [Curve; CHANNELS],
}

/// The stages that were found.
pub(super) struct Fitted {
    pub(super) unknowns: Unknowns,
    pub(super) losses: [HeatLoss; CHANNELS],
    pub(super) linear: LinearStages,
    /// Sum of squares of the standardised residuals.
    cost: f64,
    /// Root mean square of the residuals, weighted by their variances.
    pub(super) residual_rms_um: f64,
}

impl<'a> StagesFit<'a> {
    pub(super) fn new(parts: &Parts, timeline: &'a Timeline) -> Self {
        let losses = parts.actuators.each_ref().map(|actuator| HeatLoss {
            k_per_w: f64::from(actuator.thermal_resistance.0),
            growth: f64::from(actuator.loss_growth.0),
        });
        Self {
            timeline,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            losses,
            shapes: parts.actuators.each_ref().map(super::tables::forward),
        }
    }

    /// The best stages of the fits from several starts; `None` where none leads anywhere.
    pub(super) fn best(&self, starts: impl IntoIterator<Item = Unknowns>) -> Option<Fitted> {
        let fits = starts.into_iter().filter_map(|start| self.from(start));
        fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// The best stages near a start.
    fn from(&self, start: Unknowns) -> Option<Fitted> {
        let options = Options {
            bounds: Some(Unknowns::bounds(&self.losses)),
            prior: Some(start.prior()),
            cost_tolerance: TOLERANCE,
            step_tolerance: TOLERANCE,
            max_evaluations: MOST_EVALUATIONS,
            ..Options::default()
        };
        let mut at = start.coordinates();
        let mut estimate = Displacements::without_memory(&self.places_um(&start));
        let mut fitted = None;
        for _ in 0..ROUNDS {
            let projection = Projection {
                fit: self,
                estimate: &estimate,
            };
            at = minimise(&projection, &at, &options).ok()?.parameters;
            let unknowns = Unknowns::at(&at);
            let (places, memory, linear) = self.stages(&unknowns, &estimate)?;
            let (cost, residual_rms_um) = self.misfit(linear.predict(&places, &memory));
            estimate = linear.displacements(&places, &memory);
            fitted = Some(Fitted {
                losses: unknowns.losses(&self.losses),
                unknowns,
                linear,
                cost,
                residual_rms_um,
            });
        }
        fitted
    }

    /// The mean place of the four actuators in the tables as they were, at the end of every time step (um).
    fn places_um(&self, unknowns: &Unknowns) -> Vec<f64> {
        let losses = unknowns.losses(&self.losses);
        let rises = unknowns.network.rises(&self.timeline.steps, &losses);
        let mean = |rises: [f64; CHANNELS]| {
            let place = |channel: usize| {
                // The rise of the same heating under the loss that the table was made with.
                let heating = losses[channel].heating(rises[channel]);
                self.shapes[channel].at(self.losses[channel].rise(heating))
            };
            (0..CHANNELS).map(place).sum::<f64>() / CHANNELS as f64
        };
        rises.into_iter().map(mean).collect()
    }

    /// The linear stages that are best with these unknowns, and what they act on.
    fn stages(
        &self,
        unknowns: &Unknowns,
        estimate: &Displacements,
    ) -> Option<(Vec<f64>, MemoryTerms, LinearStages)> {
        let steps = &self.timeline.steps;
        let places = self.places_um(unknowns);
        let memory = MemoryTerms::new(steps, self.top_um, unknowns.release_s, estimate);
        let linear = LinearStages::fit(steps, self.top_um, &places, &memory)?;
        Some((places, memory, linear))
    }

    /// The standardised residuals of all readings, predicted less measured.
    fn residuals(&self, predicted: impl Iterator<Item = f64>) -> Vec<f64> {
        let steps = self.timeline.steps.iter().zip(predicted);
        steps
            .filter_map(|(step, z_um)| {
                let read = step.displacement?;
                Some((z_um - read.z_um) / read.standard_deviation_um)
            })
            .collect()
    }

    /// The sum of squares of the standardised residuals, and the weighted root mean square in um.
    fn misfit(&self, predicted: impl Iterator<Item = f64>) -> (f64, f64) {
        let cost: f64 = self.residuals(predicted).iter().map(|r| r * r).sum();
        let readings = self
            .timeline
            .steps
            .iter()
            .filter_map(|step| step.displacement);
        let weights: f64 = readings.map(|r| r.standard_deviation_um.powi(-2)).sum();
        (cost, (cost / weights).sqrt())
    }

    /// What each actuator's resistance, read by its line, tells where the mirror rests, up to these rises (K).
    pub(super) fn sensed_rises(
        &self,
        fitted: &Fitted,
        lines: &[Option<Line>; CHANNELS],
        tops_k: [f64; CHANNELS],
    ) -> [Option<SensedRises>; CHANNELS] {
        let network = &fitted.unknowns.network;
        let rises = network.rises_unsettled(&self.timeline.steps, &fitted.losses);
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

/// The residuals as a function of the nonlinear unknowns alone.
struct Projection<'a> {
    fit: &'a StagesFit<'a>,
    estimate: &'a Displacements,
}

impl Problem for Projection<'_> {
    fn residuals(&self, coordinates: &DVector<f64>) -> Option<DVector<f64>> {
        let unknowns = Unknowns::at(coordinates);
        let (places, memory, linear) = self.fit.stages(&unknowns, self.estimate)?;
        let residuals = self.fit.residuals(linear.predict(&places, &memory));
        Some(DVector::from_vec(residuals))
    }

    fn difference_step(&self) -> DifferenceStep {
        DifferenceStep::Absolute(DIFFERENCE)
    }
}
