//! Poses asked one after the other, and the heat that the four actuators had then.
//!
//! Under a calibration the core makes every actuator as warm as its place asks for, and knows with which heating: so what the
//! heating would have done with poles shared otherwise, or with another growth of the loss, follows from what was asked.

use control_core::calibration::{POLES, Parts, Plate};
use control_core::shape::SEGMENTS;
use control_core::{CHANNELS, Limits, Micrometre, PlateInverse, Pose, Radian};

use super::point::PosePoint;
use crate::reach::PlatePose;

/// First time step after a jump (s), and by which part of the time since then a step is longer: the heating of all poles is followed, from
/// a beam's millisecond to a package's seconds.
const FIRST_STEP_S: f64 = 1e-3;
const GROWING: f64 = 0.3;

/// Where an actuator was, and what heat would have made of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// Temperature rise that its place asks for (K).
    rise: f64,
    /// What the rise gains with each pole that is shared wholly and not at all (K).
    per_shared: [f64; POLES],
    /// What it gains with the growth of the loss (K per 1/K), where the tables keep what they say of rest.
    per_growth: f64,
}

/// An actuator's table in f64.
#[derive(Clone, Debug)]
pub(super) struct Table {
    top_um: f64,
    knots_k: Vec<f64>,
}

/// One number of each actuator.
type Each = [f64; CHANNELS];

impl Table {
    pub(super) fn rise(&self, um: f64) -> f64 {
        let place = (um / self.top_um * SEGMENTS as f64).max(0.0);
        let segment = (place as usize).min(SEGMENTS - 1);
        let (low, high) = (self.knots_k[segment], self.knots_k[segment + 1]);
        low + (place - segment as f64) * (high - low)
    }

    /// The position at a rise, straight on beyond the ends (um).
    pub(super) fn position_um(&self, rise: f64) -> f64 {
        let above = self.knots_k.partition_point(|knot| *knot <= rise);
        let segment = above.clamp(1, SEGMENTS) - 1;
        let (low, high) = (self.knots_k[segment], self.knots_k[segment + 1]);
        self.top_um / SEGMENTS as f64 * (segment as f64 + (rise - low) / (high - low))
    }
}

impl Place {
    /// The rise with poles shared by so much more, and a loss that grows by so much more (1/K).
    pub(super) fn rise(&self, more_shared: &[f64; POLES], more_growth: f64) -> f64 {
        let shared = more_shared.iter().zip(&self.per_shared);
        let gained: f64 = shared.map(|(more, per)| more * per).sum();
        self.rise + gained + more_growth * self.per_growth
    }
}

pub(super) fn tables(parts: &Parts) -> [Table; CHANNELS] {
    parts.actuators.each_ref().map(|actuator| Table {
        top_um: f64::from(actuator.shape.top().0),
        knots_k: actuator
            .shape
            .knots()
            .iter()
            .map(|k| f64::from(*k))
            .collect(),
    })
}

/// Positions that the core gives its actuators for a pose (um), with what limits them.
pub(super) fn positions_um(plate: &Plate, top_um: f64, pose: &PlatePose) -> Each {
    let pose = Pose {
        z: Micrometre(pose.z_um as f32),
        tilt_x: Radian(pose.tilt_x_rad as f32),
        tilt_y: Radian(pose.tilt_y_rad as f32),
    };
    let mut limits = Limits::NONE;
    let plate = PlateInverse::new(plate, Micrometre(top_um as f32));
    plate.positions(&pose, &mut limits).map(f64::from)
}

/// Where the actuators were at each point.
pub(super) fn places(parts: &Parts, points: &[PosePoint]) -> Vec<[Place; CHANNELS]> {
    let tables = tables(parts);
    let mut heat = HeatedPoles::new(parts);
    let mut places = Vec::with_capacity(points.len());
    for point in points {
        let positions = positions_um(&parts.plate, tables[0].top_um, &point.asked);
        let rises: Each = std::array::from_fn(|i| tables[i].rise(positions[i]));
        let mut passed_s = 0.0;
        while passed_s < point.held_s {
            let step_s = (point.held_s - passed_s).min(FIRST_STEP_S.max(GROWING * passed_s));
            heat.hold(&rises, step_s);
            passed_s += step_s;
        }
        places.push(std::array::from_fn(|i| heat.place(i, rises[i])));
    }
    places
}

/// The poles of a calibration, and how warm the four actuators made them.
struct HeatedPoles {
    poles: [Pole; POLES],
    growth: Each,
}

/// A pole as if its weight were one.
#[derive(Clone, Copy, Debug)]
struct Pole {
    weight: f64,
    time_s: f64,
    shared: f64,
    /// Driven by each actuator's own heating (K), and by the square of its rise (K2).
    own: Each,
    squares: Each,
}

impl Pole {
    /// What is left of a distance after a time step.
    fn left(&self, step_s: f64) -> f64 {
        match self.time_s > 0.0 {
            true => (-step_s / self.time_s).exp(),
            false => 0.0,
        }
    }
}

impl HeatedPoles {
    fn new(parts: &Parts) -> Self {
        let (poles, shared) = (parts.heat.poles(), parts.heat.shared);
        Self {
            poles: std::array::from_fn(|k| Pole {
                weight: f64::from(poles[k].weight),
                time_s: f64::from(poles[k].time.0),
                shared: f64::from(shared[k]),
                own: [0.0; CHANNELS],
                squares: [0.0; CHANNELS],
            }),
            growth: std::array::from_fn(|i| f64::from(parts.actuators[i].loss_growth.0)),
        }
    }

    /// A time step at whose end the rises are these. The mean of all four, and what each is apart from it, are heated apart: the one by
    /// all of every pole, the other by what of it is not shared.
    fn hold(&mut self, rises: &Each, step_s: f64) {
        let rise_mean = mean(rises);
        let (mut free_mean, mut gain_mean, mut gain_apart) = (0.0, 0.0, 0.0);
        let mut free_apart = [0.0; CHANNELS];
        for pole in &self.poles {
            let (left, at) = (pole.left(step_s), mean(&pole.own));
            let own = pole.weight * (1.0 - pole.shared);
            free_mean += pole.weight * left * at;
            gain_mean += pole.weight * (1.0 - left);
            gain_apart += own * (1.0 - left);
            for (free, state) in free_apart.iter_mut().zip(&pole.own) {
                *free += own * left * (state - at);
            }
        }
        let heating_mean = (rise_mean - free_mean) / gain_mean;
        for pole in &mut self.poles {
            let left = pole.left(step_s);
            let relax = |at: &mut f64, to: f64| *at = to + (*at - to) * left;
            for i in 0..CHANNELS {
                let apart = (rises[i] - rise_mean - free_apart[i]) / gain_apart;
                relax(&mut pole.own[i], heating_mean + apart);
                relax(&mut pole.squares[i], rises[i] * rises[i]);
            }
        }
    }

    fn place(&self, i: usize, rise: f64) -> Place {
        // What more heat makes, less what the growing loss takes of it.
        let loss_slope = 1.0 + 2.0 * self.growth[i] * rise;
        let per_shared = |pole: &Pole| pole.weight * (mean(&pole.own) - pole.own[i]) / loss_slope;
        let followed = self.poles.iter().map(|pole| pole.weight * pole.squares[i]);
        Place {
            rise,
            per_shared: self.poles.each_ref().map(per_shared),
            per_growth: (rise * rise - followed.sum::<f64>()) / loss_slope,
        }
    }
}

fn mean(of: &Each) -> f64 {
    of.iter().sum::<f64>() / CHANNELS as f64
}
