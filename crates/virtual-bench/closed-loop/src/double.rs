//! The control core's chain once more, in f64, written from the stages' equations: what the core's f32 arithmetic is
//! judged by.
//!
//! It is told what the core is told: positions, and the drives and currents of the tick that ended. A state here is the
//! physical quantity itself; nothing is rearranged for speed.

mod actuator;
mod apart;
mod hysteresis;
mod path;
mod poles;
mod table;

use control_core::calibration::{Calibration, Lever};
use control_core::{Ampere, CHANNELS, Pose, Setpoint, Volt};

use actuator::Actuator;
use apart::Apart;
use hysteresis::{Hysteresis, TURNS};
use path::Path;
use poles::Shared;
use table::hottest_um;

/// The chain from positions to volts.
pub(crate) struct Chain {
    levers: [Lever; CHANNELS],
    paths: [Path; CHANNELS],
    memories: [Hysteresis; CHANNELS],
    actuators: [Actuator; CHANNELS],
    shared: Shared,
    top_um: f64,
    hottest_um: f64,
    turn: usize,
}

impl Chain {
    /// A chain at rest.
    pub(crate) fn new(calibration: &Calibration) -> Self {
        let parts = calibration.parts();
        Self {
            levers: parts.plate.levers,
            paths: std::array::from_fn(|_| Path::new(&parts.path)),
            memories: std::array::from_fn(|_| Hysteresis::new(&parts.memory, parts.bounds.drive)),
            actuators: parts
                .actuators
                .map(|actuator| Actuator::new(actuator, parts)),
            shared: Shared::new(parts),
            top_um: f64::from(calibration.max_position().0),
            hottest_um: hottest_um(parts),
            turn: 0,
        }
    }

    /// A tick beside the core's, with what was sensed in the one before, and the `drives` that the core answered.
    ///
    /// # Panics
    /// Where it is asked for voltages: they are no business of this chain.
    pub(crate) fn step(
        &mut self,
        setpoint: Setpoint,
        (applied, currents): ([Volt; CHANNELS], [Ampere; CHANNELS]),
        drives: [Volt; CHANNELS],
    ) -> Apart {
        let turn = self.turn % CHANNELS;
        self.actuators[turn].sense(applied[turn], currents[turn]);
        let mut apart = Apart::default();
        for (i, core) in drives.into_iter().enumerate() {
            let z = match setpoint {
                Setpoint::Position(pose) => self.paths[i].toward(self.position(i, pose)),
                Setpoint::Track(pose) => {
                    let position = self.position(i, pose);
                    self.paths[i].follow(position)
                }
                Setpoint::Off | Setpoint::Drive(_) => panic!("no position"),
            };
            if i == turn {
                self.memories[i].turn(self.turn / CHANNELS, z, applied[i]);
            }
            let x = self.memories[i].displacement(z).min(self.hottest_um);
            let one = self.actuators[i].heat_to(x, f64::from(core.0));
            apart.drive_um = apart.drive_um.max(one.drive_um);
            apart.mirror_um = apart.mirror_um.max(one.mirror_um);
        }
        let actuator = &mut self.actuators[turn];
        actuator.relax_slow(self.shared.turn(turn, actuator.heating()));
        self.turn = (self.turn + 1) % TURNS;
        apart
    }

    /// Where an actuator is in a pose that all of them can reach without a warp (um).
    fn position(&self, actuator: usize, pose: Pose) -> f64 {
        let Lever { x, y, .. } = self.levers[actuator];
        let tilted =
            f64::from(y.0) * f64::from(pose.tilt_x.0) - f64::from(x.0) * f64::from(pose.tilt_y.0);
        (f64::from(pose.z.0) + tilted).clamp(0.0, self.top_um)
    }
}
