//! The mirror in time.

mod surroundings;

use crate::build::Build;
use crate::config::{ConfigError, MirrorConfig};
use crate::effects::Effects;
use crate::effects::memory::{Memory, Stiction};
use crate::effects::reading::filter_hz;
use crate::effects::structure::reconstruct;
use crate::motion::{Course, Flow, Mode};
use crate::per_actuator::PerActuator;
use crate::shape::{Displacement, Shape};
use crate::slow::Slow;
use crate::thermal::{Drive, Field, Network, Stepper};

/// Error allowed of one step's second-order solution (K). The third-order one that is kept is closer by far: the tests
/// hold it within a nanometre of steps half as long.
const TOLERANCE_K: f64 = 0.003;
/// Bend allowed within one step of the course that the plate follows, beyond a parabola (m).
const TOLERANCE_M: f64 = 10e-9;
/// Longest step, so that nothing slower is stepped over (s).
const LONGEST_S: f64 = 1000.0;
const SHORTEST_S: f64 = 1e-9;
/// Time that passes for none (s).
const NO_TIME_S: f64 = 1e-12;
/// Longest time that one call lets pass (s): a mirror settles in minutes, and no call may hang.
const DAY_S: f64 = 86_400.0;

/// Everything that can be seen of a mirror at one moment, without noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Displacement of the plate's centre from its 0 V rest position, positive towards the substrate (um).
    pub z_um: f64,
    /// The same with what a stage adds, behind the output filter of the displacement sensor if it has one: where its
    /// target seems to be (um).
    pub seen_z_um: f64,
    /// Tilt about the x axis (deg): positive when the +y edge, actuator 2's, is nearer to the substrate than actuator
    /// 4's.
    pub tilt_x_deg: f64,
    /// Tilt about the y axis (deg): positive when the +x edge, actuator 1's, is nearer than actuator 3's.
    pub tilt_y_deg: f64,
    /// Current of each actuator (A), with the drive's sign.
    pub current_a: [f64; 4],
    /// Hottest temperature anywhere in the mirror (K above ambient).
    pub hottest_k: f64,
    /// Mean temperature of each heater (K above ambient): what its resistance tells.
    pub heater_mean_k: [f64; 4],
    /// Temperature of the room (degC).
    pub ambient_c: f64,
}

/// A mirror being driven.
#[derive(Clone, Debug)]
pub struct VirtualMirror {
    network: Network,
    shape: Shape,
    lever: f64,
    drive_limit: f64,
    ambient_c: f64,
    effects: Effects,
    /// How far the whole mirror stands from where it was (m).
    stage: f64,
    modes: Option<[Mode; 3]>,
    filter: Option<Mode>,
    memory: Memory,
    stiction: Option<Stiction>,
    slow: Option<Slow>,
    /// Plastic strain of every cell (K).
    plastic: Vec<PerActuator>,
    stepper: Stepper,
    /// Step that the error control would take next (s).
    stride: f64,
    time: f64,
    drive: PerActuator,
    theta: Field,
    rate: Field,
    /// Rate of temperatures belongs to this drive; after a jump it is stale.
    rate_drive: PerActuator,
    next: Field,
    next_rate: Field,
    /// Static displacement of the actuators, and where it goes in the step being taken.
    still: Displacement,
    next_still: Displacement,
    next_memory: Memory,
    /// Piston (m), tilts (rad).
    pose: [Flow; 3],
    next_pose: [Flow; 3],
    filtered: Flow,
    next_filtered: Flow,
}

impl VirtualMirror {
    /// A mirror at rest: 0 V for ever.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range.
    pub fn new(config: &MirrorConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let config = &reconstruct(config);
        let Build { network, shape } = Build::new(config);
        let cells = network.cells.len();
        let zero = Field::zero(cells);
        let modes = config.motion.map(|m| {
            [m.piston_hz, m.tilt_hz, m.tilt_hz].map(|frequency| Mode::new(frequency, m.q))
        });
        let memory = Memory::new(&config.effects);
        Ok(Self {
            stepper: Stepper::new(cells),
            shape,
            lever: config.plate.lever_um * 1e-6,
            drive_limit: config.drive_limit_v,
            ambient_c: config.ambient_c,
            effects: config.effects.clone(),
            stage: 0.0,
            modes,
            filter: filter_hz(&config.effects).map(|frequency| Mode::new(frequency, 0.501)),
            memory,
            next_memory: memory,
            stiction: Stiction::new(&config.effects),
            slow: Slow::new(config, &network),
            plastic: vec![PerActuator::ZERO; cells],
            network,
            stride: 1e-4,
            time: 0.0,
            drive: PerActuator::ZERO,
            rate_drive: PerActuator::ZERO,
            theta: zero.clone(),
            rate: zero.clone(),
            next: zero.clone(),
            next_rate: zero,
            still: Displacement::none(cells),
            next_still: Displacement::none(cells),
            pose: [Flow::default(); 3],
            next_pose: [Flow::default(); 3],
            filtered: Flow::default(),
            next_filtered: Flow::default(),
        })
    }

    /// Time since the mirror was made (s).
    pub fn time_s(&self) -> f64 {
        self.time
    }

    /// Holds `drive_v` (V) for one tick of `dt_s` seconds: [`advance`](Self::advance) under the name a control loop
    /// expects, and as exact.
    pub fn step(&mut self, drive_v: [f64; 4], dt_s: f64) {
        self.advance(drive_v, dt_s);
    }

    /// Holds `drive_v` (V) for `duration_s` seconds.
    ///
    /// A drive beyond the rails is held at them, NaN counts as 0 V, and a negative drive heats like a positive one. A
    /// duration below a picosecond, or not finite, passes no time, but the drive is applied; one beyond a day counts as a
    /// day.
    pub fn advance(&mut self, drive_v: [f64; 4], duration_s: f64) {
        let drive = self.admit(drive_v);
        self.integrate(
            Drive {
                from: drive,
                to: drive,
            },
            duration_s,
        );
    }

    /// Moves the drive in a straight line from where it is to `drive_v` (V) within `duration_s` seconds.
    pub fn advance_ramp(&mut self, drive_v: [f64; 4], duration_s: f64) {
        let drive = Drive {
            from: self.drive,
            to: self.admit(drive_v),
        };
        self.integrate(drive, duration_s);
    }

    /// What can be seen now.
    pub fn state(&self) -> State {
        let resistance = self.network.resistance(&self.theta);
        let [z, tilt_x, tilt_y] = self.pose.map(|flow| flow.value);
        let filtered = |_: &Mode| self.filtered.value;
        let seen = self.filter.as_ref().map_or(z + self.stage, filtered);
        let hottest = self
            .theta
            .rows()
            .iter()
            .fold(0.0, |worst: f64, row| worst.max(row.largest()));
        State {
            z_um: z * 1e6,
            seen_z_um: seen * 1e6,
            tilt_x_deg: tilt_x.to_degrees(),
            tilt_y_deg: tilt_y.to_degrees(),
            current_a: (self.drive / resistance).0,
            hottest_k: hottest,
            heater_mean_k: self.network.heater_mean(&self.theta).0,
            ambient_c: self.ambient_c + self.network.ambient,
        }
    }

    fn admit(&self, drive: [f64; 4]) -> PerActuator {
        let limit = self.drive_limit;
        PerActuator(drive.map(|volts| {
            if volts.is_nan() {
                0.0
            } else {
                volts.clamp(-limit, limit)
            }
        }))
    }

    fn integrate(&mut self, drive: Drive, duration: f64) {
        self.drive = drive.from;
        let passes = (NO_TIME_S..f64::INFINITY).contains(&duration);
        let duration = if passes { duration.min(DAY_S) } else { 0.0 };
        let mut done = 0.0;
        while done < duration {
            let h = self.next_step(duration - done);
            let part = Drive {
                from: drive.at(done / duration),
                to: drive.at((done + h) / duration),
            };
            let error = self.try_step(&part, h);
            let fits = error <= 1.0 || h <= SHORTEST_S;
            if fits {
                self.accept(&part, h);
                done += h;
            }
            self.choose_stride(h, error, fits);
            if duration - done < 1e-12 * duration {
                break;
            }
        }
        self.drive = drive.to;
    }

    /// The stride, or what remains, in equal parts when that is less than two.
    fn next_step(&self, remaining: f64) -> f64 {
        if remaining <= self.stride {
            remaining
        } else {
            self.stride.min(0.5 * remaining)
        }
    }

    /// What stands still within a step must not have time to move.
    fn longest(&self) -> f64 {
        self.slow.as_ref().map_or(LONGEST_S, Slow::longest_s)
    }

    /// Error control: the second-order solution's error grows with the cube of the step.
    fn choose_stride(&mut self, h: f64, error: f64, fits: bool) {
        let factor = 0.85 * (1.0 / error.max(1e-9)).cbrt();
        if !fits {
            self.stride = h * factor.clamp(0.1, 0.7);
        } else if h * factor > self.stride || factor < 1.0 {
            self.stride = (h * factor.min(4.0)).clamp(SHORTEST_S, self.longest());
        }
    }

    /// Computes where a step leads; returns its error in units of what is allowed.
    fn try_step(&mut self, drive: &Drive, h: f64) -> f64 {
        if let Some(slow) = &self.slow {
            let halfway = self.still.value + self.still.rate(&self.rate) * (0.5 * h);
            slow.prepare(&mut self.network, self.time + h, halfway);
        }
        if self.rate_drive != drive.from || self.slow.is_some() {
            self.network.rate(&self.theta, drive.from, &mut self.rate);
            self.rate_drive = drive.from;
        }
        let start = (&self.theta, &self.rate);
        let error = self
            .stepper
            .step(&self.network, drive, h, start, &mut self.next);
        self.network.rate(&self.next, drive.to, &mut self.next_rate);
        self.shape.displace(
            &self.next,
            self.network.ambient,
            &self.plastic,
            &mut self.next_still,
        );
        self.next_memory = self
            .memory
            .advanced(self.still.value, self.next_still.value, h);
        let bend = self.move_plate(h);
        (error / TOLERANCE_K).max(bend / TOLERANCE_M)
    }

    fn accept(&mut self, drive: &Drive, h: f64) {
        self.time += h;
        self.rate_drive = drive.to;
        self.pose = self.next_pose;
        self.filtered = self.next_filtered;
        self.memory = self.next_memory;
        self.stiction = self
            .stiction
            .map(|stiction| stiction.advanced(self.pose[0].value));
        std::mem::swap(&mut self.theta, &mut self.next);
        std::mem::swap(&mut self.rate, &mut self.next_rate);
        std::mem::swap(&mut self.still, &mut self.next_still);
        if let Some(slow) = &self.slow {
            slow.leave(&mut self.network, &mut self.plastic, &self.theta, h);
        }
    }

    /// Lets plate and sensor follow the static position; returns how far from a parabola the piston's course was bent
    /// (m), when there is something that follows it.
    fn move_plate(&mut self, h: f64) -> f64 {
        let from = self.coordinates(&self.memory, &self.still, &self.rate);
        let to = self.coordinates(&self.next_memory, &self.next_still, &self.next_rate);
        let course = |k: usize| Course {
            from: from[k],
            to: to[k],
        };
        self.next_pose = to;
        for (k, mode) in self.modes.iter_mut().flatten().enumerate() {
            self.next_pose[k] = mode.advance(self.pose[k], &course(k), h);
        }
        if let Some(filter) = &mut self.filter {
            let mut seen = course(0);
            if self.modes.is_some() {
                (seen.from, seen.to) = (self.pose[0], self.next_pose[0]);
            }
            seen.from.value += self.stage;
            seen.to.value += self.stage;
            self.next_filtered = filter.advance(self.filtered, &seen, h);
        }
        if self.modes.is_some() || self.filter.is_some() {
            course(0).bend(h)
        } else {
            0.0
        }
    }

    /// Piston and tilts of a rigid plate whose four edges the actuators hold alike.
    fn coordinates(&self, memory: &Memory, still: &Displacement, rate: &Field) -> [Flow; 3] {
        let (value, rate) = memory.outlet(still.value, still.rate(rate));
        let flow = |part: &dyn Fn(&PerActuator) -> f64| Flow {
            value: part(&value),
            rate: part(&rate),
        };
        let across = 0.5 / self.lever;
        let mut piston = flow(&|d| 0.25 * d.sum());
        piston.value += self.stiction.map_or(0.0, |stiction| stiction.pull());
        [
            piston,
            flow(&|d| across * (d.0[1] - d.0[3])),
            flow(&|d| across * (d.0[0] - d.0[2])),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::PLATE;

    #[test]
    fn at_rest_what_the_heaters_give_the_air_and_the_substrate_take() {
        let mut mirror = VirtualMirror::new(&MirrorConfig::bench()).expect("valid mirror");
        mirror.advance([3.0, 2.0, 1.0, 0.0], 100.0);
        let (network, theta) = (&mirror.network, mirror.theta.beams());
        let given = (mirror.drive * mirror.drive / network.resistance(&mirror.theta)).sum();
        let cells = network.cells.iter().zip(theta);
        let air: f64 = cells
            .map(|(cell, theta)| (cell.to_air * *theta).sum())
            .sum();
        let substrate = (network.to_frame * theta[0]).sum();
        let plate = network.lumps[PLATE].to_room * mirror.theta.lumps().0[PLATE];
        approx::assert_relative_eq!(given, air + substrate + plate, max_relative = 1e-6);
    }

    #[test]
    fn the_steps_are_of_third_order() {
        let end = |steps: u32| {
            let mut mirror = VirtualMirror::new(&MirrorConfig::bench()).expect("valid mirror");
            let drive = Drive {
                from: PerActuator::ZERO,
                to: PerActuator::splat(1.0),
            };
            for step in 0..steps {
                let at = |step: u32| drive.at(f64::from(step) / f64::from(steps));
                let part = Drive {
                    from: at(step),
                    to: at(step + 1),
                };
                let h = 2e-3 / f64::from(steps);
                mirror.try_step(&part, h);
                mirror.accept(&part, h);
            }
            mirror.theta.beams()[10].0[0]
        };
        let exact = end(1024);
        let ratio = (end(8) - exact) / (end(16) - exact);
        assert!(
            (6.0..11.0).contains(&ratio),
            "halving the step divides the error by {ratio}"
        );
    }
}
