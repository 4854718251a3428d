//! The plate that the four actuators carry, and the displacement sensor's filter behind it.

use crate::config::MirrorConfig;
use crate::effects::reading::filter_hz;
use crate::motion::{Course, Flow, Mode};
use crate::per_actuator::PerActuator;

/// Quality factor of the sensor's output filter: critical damping is 0.5, and a [`Mode`] needs to ring ever so little.
const FILTER_Q: f64 = 0.501;

/// Where the plate is, and what the sensor's filter shows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PlateState {
    /// Piston (m) and tilts about x and y (rad).
    pub(crate) pose: [Flow; 3],
    /// Output of the sensor's filter (m).
    filtered: Flow,
}

/// How plate and filter follow the actuators.
#[derive(Clone, Debug)]
pub(crate) struct PlateDynamics {
    lever_m: f64,
    /// How far a stage has moved the whole mirror (m).
    pub(super) stage_m: f64,
    /// The modes of piston and tilts; without them the plate follows at once.
    modes: Option<[Mode; 3]>,
    filter: Option<Mode>,
}

impl PlateDynamics {
    pub(crate) fn new(config: &MirrorConfig) -> Self {
        let modes = config.motion.map(|m| {
            [m.piston_hz, m.tilt_hz, m.tilt_hz].map(|frequency| Mode::new(frequency, m.q))
        });
        Self {
            lever_m: config.plate.lever_um * 1e-6,
            stage_m: 0.0,
            modes,
            filter: filter_hz(&config.effects).map(|frequency| Mode::new(frequency, FILTER_Q)),
        }
    }

    pub(crate) fn set_stage(&mut self, stage_m: f64) {
        self.stage_m = stage_m;
    }

    /// Static piston and tilts of a rigid plate whose four edges the actuators hold alike, at displacements `value` (m)
    /// that change at `rate` (m/s); `pull_m` is what pulls the plate down besides.
    pub(crate) fn pose(&self, value: PerActuator, rate: PerActuator, pull_m: f64) -> [Flow; 3] {
        let flow = |part: &dyn Fn(&PerActuator) -> f64| Flow {
            value: part(&value),
            rate: part(&rate),
        };
        let across = 0.5 / self.lever_m;
        let mut piston = flow(&|d| 0.25 * d.sum());
        piston.value += pull_m;
        [
            piston,
            flow(&|d| across * (d.0[1] - d.0[3])),
            flow(&|d| across * (d.0[0] - d.0[2])),
        ]
    }

    /// Where plate and filter are after `h` seconds in which the static pose took `courses`.
    pub(crate) fn advance(&mut self, now: &PlateState, courses: [Course; 3], h: f64) -> PlateState {
        let mut next = PlateState {
            pose: courses.map(|course| course.to),
            filtered: now.filtered,
        };
        for (k, mode) in self.modes.iter_mut().flatten().enumerate() {
            next.pose[k] = mode.advance(now.pose[k], &courses[k], h);
        }
        if let Some(filter) = &mut self.filter {
            let mut target = courses[0];
            if self.modes.is_some() {
                (target.from, target.to) = (now.pose[0], next.pose[0]);
            }
            target.from.value += self.stage_m;
            target.to.value += self.stage_m;
            next.filtered = filter.advance(now.filtered, &target, h);
        }
        next
    }

    /// How far from a parabola the piston's course of `h` seconds is bent (m), when there is something that follows
    /// it.
    pub(crate) fn bend(&self, piston: &Course, h: f64) -> f64 {
        if self.modes.is_some() || self.filter.is_some() {
            piston.bend(h)
        } else {
            0.0
        }
    }

    /// Where the sensor's target seems to be (m).
    pub(crate) fn seen(&self, plate: &PlateState) -> f64 {
        if self.filter.is_some() {
            plate.filtered.value
        } else {
            plate.pose[0].value + self.stage_m
        }
    }
}
