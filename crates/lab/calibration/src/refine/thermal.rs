//! The thermal stages forward: from the powers of a session to where its tables have the mirror.

use control_core::CHANNELS;
use control_core::calibration::Parts;

use super::heat::{HeatLoss, Lags};
use super::timeline::Timeline;
use super::unknowns::Unknowns;
use crate::curve::Curve;

/// Temperature rises of the beams, and what their heaters and fast poles have still to bring (K).
pub(super) type Rises = [(f64, f64); CHANNELS];

/// A session, and the tables that it was measured under.
pub(super) struct Thermal {
    pub(super) timeline: Timeline,
    /// Where the tables end.
    pub(super) top_um: f64,
    /// The highest drive (V).
    pub(super) highest_v: f64,
    /// The heat losses that the tables were made with.
    pub(super) losses: [HeatLoss; CHANNELS],
    /// The tables read forward: temperature rise (K) to displacement (um).
    shapes: [Curve; CHANNELS],
}

impl Thermal {
    pub(super) fn new(parts: &Parts, timeline: Timeline) -> Self {
        Self {
            timeline,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            highest_v: f64::from(parts.bounds.drive.0),
            losses: parts.actuators.each_ref().map(|actuator| HeatLoss {
                k_per_w: f64::from(actuator.thermal_resistance.0),
                growth: f64::from(actuator.loss_growth.0),
            }),
            shapes: parts.actuators.each_ref().map(super::tables::forward),
        }
    }

    /// The rises of the beams, which follow their heaters, at the end of every time step, and what these and their fast poles have still to
    /// bring then (K).
    pub(super) fn rises(&self, unknowns: &Unknowns) -> Vec<Rises> {
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
    pub(super) fn places_um(&self, unknowns: &Unknowns, rises: &[Rises]) -> Vec<f64> {
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
}
