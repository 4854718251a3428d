//! What takes a mirror from one moment to the next: heat, shape, history, plate, one after the other.

use super::plate::{PlateDynamics, PlateState};
use crate::build::Build;
use crate::config::MirrorConfig;
use crate::effects::Effects;
use crate::effects::electrostatic::Electrostatic;
use crate::effects::heat::LossLaw;
use crate::effects::memory::{Memory, Stiction};
use crate::motion::{Course, Flow};
use crate::per_actuator::PerActuator;
use crate::shape::{Displacement, Shape};
use crate::slow::Slow;
use crate::state::State;
use crate::thermal::field::PLATE;
use crate::thermal::{Drive, Field, Network, Stepper};

/// Error allowed of one step's second-order solution (K). The third-order one that is kept is closer by far:
/// `tests/physics.rs` holds it within a nanometre of steps half as long.
const TOLERANCE_K: f64 = 0.003;
/// Bend allowed within one step of the course that the plate follows, beyond a parabola (m): set so that the same tests
/// hold with modes and filter on.
const TOLERANCE_M: f64 = 10e-9;
/// Longest step, so that nothing slower is stepped over (s).
const LONGEST_S: f64 = 1000.0;
/// Time in which the room jumps to another temperature, for what remembers motion (s).
const JUMP_S: f64 = 1e-6;

/// All that a mirror's future depends on, besides what stands still within a step and is kept in the [`System`].
#[derive(Clone, Debug)]
pub(crate) struct StateVector {
    /// Time since the mirror was made (s).
    pub(crate) time_s: f64,
    /// Temperatures above ambient (K).
    pub(crate) theta: Field,
    /// How fast they change (K/s) at the drive `rate_at`; stale where that is `None`, or another.
    rate: Field,
    rate_at: Option<PerActuator>,
    /// Displacement of the actuators without history.
    displacement: Displacement,
    /// History of the displacement.
    memory: Memory,
    stiction: Option<Stiction>,
    plate: PlateState,
}

/// The mirror's equations.
#[derive(Clone, Debug)]
pub(crate) struct System {
    ambient_c: f64,
    effects: Effects,
    pub(crate) network: Network,
    shape: Shape,
    slow: Option<Slow>,
    electrostatic: Option<Electrostatic>,
    pub(crate) plate: PlateDynamics,
    stepper: Stepper,
    air_at_first: Air,
    /// By what the air's conductances were multiplied since.
    air_factor: f64,
}

/// Conductances to the air (W/K).
#[derive(Clone, Debug)]
struct Air {
    to_beams: Vec<PerActuator>,
    to_plate: f64,
}

impl System {
    /// The equations of the mirror that `config` describes.
    pub(crate) fn new(config: &MirrorConfig) -> Self {
        let Build { network, shape } = Build::new(config);
        Self {
            ambient_c: config.ambient_c,
            effects: config.effects.clone(),
            slow: Slow::new(config, &network),
            electrostatic: Electrostatic::new(&config.effects),
            plate: PlateDynamics::new(config),
            stepper: Stepper::new(network.cells.len()),
            air_at_first: Air {
                to_beams: network.cells.iter().map(|cell| cell.to_air).collect(),
                to_plate: network.lumps[PLATE].to_room,
            },
            air_factor: 1.0,
            network,
            shape,
        }
    }

    /// 0 V for ever.
    pub(crate) fn at_rest(&self, effects: &Effects) -> StateVector {
        let cells = self.network.cells.len();
        StateVector {
            time_s: 0.0,
            theta: Field::zero(cells),
            rate: Field::zero(cells),
            rate_at: Some(PerActuator::ZERO),
            displacement: Displacement::none(cells),
            memory: Memory::new(effects),
            stiction: Stiction::new(effects),
            plate: PlateState::default(),
        }
    }

    /// Longest step (s): what stands still within a step must not have time to move.
    pub(crate) fn longest_step_s(&self) -> f64 {
        self.slow.as_ref().map_or(LONGEST_S, Slow::longest_s)
    }

    /// Makes ready for a step of `h` seconds from `now` that starts at `drive`: what changes slowly is set to where it is
    /// at the step's end, and the temperatures' rate is brought up to date.
    pub(crate) fn prepare(&mut self, now: &mut StateVector, drive: PerActuator, h: f64) {
        if let Some(slow) = &self.slow {
            let displacement = &now.displacement;
            let halfway = displacement.value + displacement.rate(&now.rate) * (0.5 * h);
            slow.prepare(&mut self.network, now.time_s + h, halfway);
        }
        if now.rate_at != Some(drive) || self.slow.is_some() {
            self.network.rate(&now.theta, drive, &mut now.rate);
            now.rate_at = Some(drive);
        }
    }

    /// Takes a step of `h` seconds from `now`, made ready, to `next`; returns its error in units of what is allowed.
    pub(crate) fn advance(
        &mut self,
        now: &StateVector,
        drive: &Drive,
        h: f64,
        next: &mut StateVector,
    ) -> f64 {
        next.time_s = now.time_s + h;
        let start = (&now.theta, &now.rate);
        let error_k = self
            .stepper
            .step(&self.network, drive, h, start, &mut next.theta);
        self.network.rate(&next.theta, drive.to, &mut next.rate);
        next.rate_at = Some(drive.to);

        let ambient = self.network.ambient;
        self.shape
            .displace(&next.theta, ambient, &mut next.displacement);
        let (from, to) = (now.displacement.value, next.displacement.value);
        next.memory = now.memory.advanced(from, to, h);

        // The plate that sticks, or not, does so until the step's end.
        let stuck_m = now.stiction.map_or(0.0, |stiction| stiction.pull());
        let from = self.pose(now, stuck_m + self.pull(drive.from, now));
        let to = self.pose(next, stuck_m + self.pull(drive.to, next));
        let courses = std::array::from_fn(|k| Course {
            from: from[k],
            to: to[k],
        });
        next.plate = self.plate.advance(&now.plate, courses, h);
        let piston = next.plate.pose[0].value;
        next.stiction = now.stiction.map(|stiction| stiction.advanced(piston));

        let bend_m = self.plate.bend(&courses[0], h);
        (error_k / TOLERANCE_K).max(bend_m / TOLERANCE_M)
    }

    /// Keeps what a step of `h` seconds to `now`, once accepted, leaves behind.
    pub(crate) fn settle(&mut self, now: &StateVector, h: f64) {
        if let Some(slow) = &self.slow {
            slow.leave(&mut self.network, &mut self.shape, &now.theta, h);
        }
    }

    /// How far the beams at these drives pull the plate down (m), from where heat alone holds it.
    fn pull(&self, volts: PerActuator, at: &StateVector) -> f64 {
        let piston = 0.25 * at.displacement.value.sum();
        self.electrostatic
            .map_or(0.0, |electrostatic| electrostatic.pull(volts, piston))
    }

    /// Static pose of the plate, with history.
    fn pose(&self, at: &StateVector, pull_m: f64) -> [Flow; 3] {
        let rate = at.displacement.rate(&at.rate);
        let (value, rate) = at.memory.outlet(at.displacement.value, rate);
        self.plate.pose(value, rate, pull_m)
    }

    /// Makes the room `rise_k` warmer than it was at first (K), and `now` with it.
    pub(crate) fn set_ambient(&mut self, now: &mut StateVector, rise_k: f64) {
        let network = &mut self.network;
        if rise_k == network.ambient_set {
            return;
        }
        network.ambient += rise_k - network.ambient_set;
        network.ambient_set = rise_k;
        network.loss = LossLaw::new(&self.effects, self.ambient_c + rise_k, rise_k);
        self.jump(now);
    }

    /// Brings `now` to where these equations, all at once others than before, have it.
    fn jump(&self, now: &mut StateVector) {
        let before = now.displacement.value;
        self.shape
            .displace(&now.theta, self.network.ambient, &mut now.displacement);
        now.memory = now.memory.advanced(before, now.displacement.value, JUMP_S);
        now.rate_at = None;
    }

    /// Goes on from `now`, where these equations come after those `before` them.
    pub(crate) fn take_over(&mut self, before: &Self, now: &mut StateVector) {
        if before.network.cells.len() != self.network.cells.len() {
            *now = self.at_rest(&self.effects);
        }
        self.plate.set_stage(before.plate.stage_m);
        self.set_ambient(now, before.network.ambient_set);
        self.set_air_loss(now, before.air_factor);
        self.jump(now);
    }

    /// Makes the air take `factor` times the heat that it took at first from beams and plate.
    pub(crate) fn set_air_loss(&mut self, now: &mut StateVector, factor: f64) {
        let network = &mut self.network;
        if factor == self.air_factor {
            return;
        }
        let air = &self.air_at_first;
        for (cell, first) in network.cells.iter_mut().zip(&air.to_beams) {
            cell.to_air = *first * factor;
        }
        network.lumps[PLATE].to_room = air.to_plate * factor;
        self.air_factor = factor;
        now.rate_at = None;
    }

    /// What can be seen of `now` at `drive`.
    pub(crate) fn seen(&self, now: &StateVector, drive: PerActuator) -> State {
        let resistance = self.network.resistance(&now.theta);
        let [z, tilt_x, tilt_y] = now.plate.pose.map(|flow| flow.value);
        let rows = now.theta.rows().iter();
        State {
            z_um: z * 1e6,
            seen_z_um: self.plate.seen(&now.plate) * 1e6,
            tilt_x_deg: tilt_x.to_degrees(),
            tilt_y_deg: tilt_y.to_degrees(),
            current_a: (drive / resistance).0,
            hottest_k: rows.fold(0.0, |worst: f64, row| worst.max(row.largest())),
            heater_mean_k: self.network.heater_mean(&now.theta).0,
            ambient_c: self.ambient_c + self.network.ambient,
        }
    }
}
