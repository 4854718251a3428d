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

use control_core::calibration::Calibration;
use control_core::{Ampere, CHANNELS, Micrometre, Setpoint, Volt};

use actuator::Actuator;
use apart::Apart;
use hysteresis::Hysteresis;
use path::Path;
use poles::TURNS;
use table::hottest_um;

/// The chain from positions to volts.
pub(crate) struct Chain {
    path: Path,
    memory: Hysteresis,
    actuators: [Actuator; CHANNELS],
    top_um: f64,
    hottest_um: f64,
    turn: usize,
}

impl Chain {
    /// A chain at rest.
    pub(crate) fn new(calibration: &Calibration) -> Self {
        let parts = calibration.parts();
        Self {
            path: Path::new(f64::from(parts.path.move_time.0)),
            memory: Hysteresis::new(&parts.memory),
            actuators: parts
                .actuators
                .map(|actuator| Actuator::new(actuator, parts)),
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
        for (i, actuator) in self.actuators.iter_mut().enumerate() {
            actuator.sense(applied[i], currents[i]);
        }
        let within = |z: Micrometre| f64::from(z.0).clamp(0.0, self.top_um);
        let z = match setpoint {
            Setpoint::Position(z) => self.path.toward(within(z)),
            Setpoint::Track(z) => self.path.follow(within(z)),
            Setpoint::Off | Setpoint::Drive(_) => panic!("no position"),
        };
        let x = self.memory.displacement(z).min(self.hottest_um);
        let mut apart = Apart::default();
        for (actuator, drive) in self.actuators.iter_mut().zip(drives) {
            let one = actuator.heat_to(x, f64::from(drive.0));
            apart.drive_um = apart.drive_um.max(one.drive_um);
            apart.mirror_um = apart.mirror_um.max(one.mirror_um);
        }
        self.actuators[self.turn].relax_slow();
        self.turn = (self.turn + 1) % TURNS;
        apart
    }
}
