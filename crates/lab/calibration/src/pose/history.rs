//! Poses asked one after the other, and the powers that the four actuators had meanwhile.
//!
//! Under a calibration the core makes every actuator as warm as its place asks for, and knows with which power: so what the
//! powers would have done with poles shared otherwise, or with another growth of the loss, follows from what was asked.

use control_core::calibration::{Parts, Plate};
use control_core::{Micrometre, PlateInverse};

use super::heat::{Each, PoleDecay, SharedHeat, Warmed};
use super::point::PosePoint;
use super::tables::tables;
use crate::plate_pose::PlatePose;

/// First time step after a jump (s), and by which part of the time since then a step is longer: the heating of all poles is followed, from
/// a beam's millisecond to a package's seconds.
const FIRST_STEP_S: f64 = 1e-3;
const GROWING: f64 = 0.3;

/// The powers of all time steps.
pub(super) struct History {
    steps: Vec<Powered>,
    /// How many steps had passed at each point.
    passed: Vec<usize>,
}

/// A time step.
struct Powered {
    time: PoleDecay,
    /// As the rises that they would hold without growth (K).
    powers: Each,
}

/// Positions that the core gives its actuators for a pose (um), with what limits them.
pub(super) fn positions_um(plate: &Plate, top_um: f64, pose: &PlatePose) -> Each {
    let plate = PlateInverse::new(plate, Micrometre(top_um as f32));
    plate.positions(&(*pose).into()).0.map(f64::from)
}

impl History {
    /// What was driven under a calibration for these points.
    pub(super) fn new(parts: &Parts, points: &[PosePoint]) -> Self {
        let top_um = f64::from(parts.actuators[0].shape.top().0);
        let (tables, heat) = (tables(parts), SharedHeat::of(parts));
        let mut warmed = Warmed::default();
        let (mut steps, mut passed) = (Vec::new(), Vec::with_capacity(points.len()));
        for point in points {
            let positions = positions_um(&parts.plate, top_um, &point.asked);
            let rises: Each = std::array::from_fn(|i| tables[i].rise(positions[i]));
            let mut passed_s = 0.0;
            while passed_s < point.held_s {
                let step_s = (point.held_s - passed_s).min(FIRST_STEP_S.max(GROWING * passed_s));
                let time = heat.time_step(step_s);
                let powers = heat.hold(&mut warmed, &rises, &time);
                steps.push(Powered { time, powers });
                passed_s += step_s;
            }
            passed.push(steps.len());
        }
        Self { steps, passed }
    }

    /// How warm these powers make the actuators until each point, with this heat.
    pub(super) fn rises(&self, heat: &SharedHeat) -> Vec<Each> {
        let mut warmed = Warmed::default();
        let (mut rises, mut done) = (Each::default(), 0);
        let at = |passed: &usize| {
            for step in &self.steps[done..*passed] {
                rises = heat.heat(&mut warmed, &step.powers, &step.time);
            }
            done = *passed;
            rises
        };
        self.passed.iter().map(at).collect()
    }
}
