//! The mirror in time.

use crate::build::Build;
use crate::config::{ConfigError, MirrorConfig};
use crate::lanes::Lanes;
use crate::motion::{Course, Flow, Mode};
use crate::shape::{Displacement, Shape};
use crate::thermal::{Drive, Field, Network, Stepper};

/// Error allowed of one step's second-order solution (K). The third-order one that is kept is closer by far: the tests
/// hold it within a nanometre of steps half as long.
const TOLERANCE_K: f64 = 0.02;
/// Longest step, so that nothing slower is stepped over (s).
const LONGEST_S: f64 = 20.0;
const SHORTEST_S: f64 = 1e-9;

/// Everything that can be seen of a mirror at one moment, without noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Displacement of the plate's centre from its 0 V rest position, positive towards the substrate (um).
    pub z_um: f64,
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
}

/// A mirror being driven.
#[derive(Clone, Debug)]
pub struct VirtualMirror {
    network: Network,
    shape: Shape,
    lever: f64,
    drive_limit: f64,
    modes: Option<[Mode; 3]>,
    stepper: Stepper,
    tolerance: f64,
    /// Step that the error control would take next (s).
    stride: f64,
    time: f64,
    drive: Lanes,
    theta: Field,
    rate: Field,
    /// Rate of temperatures belongs to this drive; after a jump it is stale.
    rate_drive: Lanes,
    next: Field,
    next_rate: Field,
    /// Static displacement of the actuators.
    still: Displacement,
    /// Piston (m), tilts (rad).
    pose: [Flow; 3],
}

impl VirtualMirror {
    /// A mirror at rest: 0 V for ever.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range.
    pub fn new(config: &MirrorConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let Build { network, shape } = Build::new(config);
        let zero = Field::zero(network.cells.len());
        let modes = config.motion.map(|m| {
            [m.piston_hz, m.tilt_hz, m.tilt_hz].map(|frequency| Mode::new(frequency, m.q))
        });
        Ok(Self {
            stepper: Stepper::new(network.cells.len()),
            network,
            shape,
            lever: config.plate.lever_um * 1e-6,
            drive_limit: config.drive_limit_v,
            modes,
            tolerance: TOLERANCE_K,
            stride: 1e-4,
            time: 0.0,
            drive: Lanes::ZERO,
            rate_drive: Lanes::ZERO,
            theta: zero.clone(),
            rate: zero.clone(),
            next: zero.clone(),
            next_rate: zero,
            still: Displacement::default(),
            pose: [Flow::default(); 3],
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
    /// duration that is not positive, or not finite, passes no time, but the drive is applied.
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
        let hottest = self
            .theta
            .rows()
            .iter()
            .fold(0.0, |worst: f64, row| worst.max(row.largest()));
        State {
            z_um: z * 1e6,
            tilt_x_deg: tilt_x.to_degrees(),
            tilt_y_deg: tilt_y.to_degrees(),
            current_a: (self.drive / resistance).0,
            hottest_k: hottest,
            heater_mean_k: self.heater_mean().0,
        }
    }

    fn heater_mean(&self) -> Lanes {
        let (mut sum, mut ohm) = (Lanes::ZERO, Lanes::ZERO);
        for (cell, theta) in self.network.cells.iter().zip(self.theta.beams()) {
            sum += cell.ohm * *theta;
            ohm += cell.ohm;
        }
        sum / ohm
    }

    fn admit(&self, drive: [f64; 4]) -> Lanes {
        let limit = self.drive_limit;
        Lanes(drive.map(|volts| {
            if volts.is_nan() {
                0.0
            } else {
                volts.clamp(-limit, limit)
            }
        }))
    }

    fn integrate(&mut self, drive: Drive, duration: f64) {
        self.drive = drive.from;
        let mut done = 0.0;
        while duration.is_finite() && done < duration {
            let h = self.next_step(duration - done);
            let part = Drive {
                from: drive.at(done / duration),
                to: drive.at((done + h) / duration),
            };
            let error = self.try_step(&part, h);
            let fits = error <= self.tolerance || h <= SHORTEST_S;
            if fits {
                self.accept(&part, h);
                done += h;
                self.time += h;
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

    /// Error control: the second-order solution's error grows with the cube of the step.
    fn choose_stride(&mut self, h: f64, error: f64, fits: bool) {
        let factor = 0.85 * (self.tolerance / error.max(1e-12)).cbrt();
        if !fits {
            self.stride = h * factor.clamp(0.1, 0.7);
        } else if h * factor > self.stride || factor < 1.0 {
            self.stride = (h * factor.min(4.0)).clamp(SHORTEST_S, LONGEST_S);
        }
    }

    fn try_step(&mut self, drive: &Drive, h: f64) -> f64 {
        if self.rate_drive != drive.from {
            self.network.rate(&self.theta, drive.from, &mut self.rate);
            self.rate_drive = drive.from;
            self.still = self.shape.displacement(&self.theta, &self.rate);
        }
        self.stepper.step(
            &self.network,
            drive,
            h,
            (&self.theta, &self.rate),
            &mut self.next,
        )
    }

    fn accept(&mut self, drive: &Drive, h: f64) {
        self.network.rate(&self.next, drive.to, &mut self.next_rate);
        let still = self.shape.displacement(&self.next, &self.next_rate);
        self.move_plate(&still, h);
        self.still = still;
        self.rate_drive = drive.to;
        std::mem::swap(&mut self.theta, &mut self.next);
        std::mem::swap(&mut self.rate, &mut self.next_rate);
    }

    fn move_plate(&mut self, still: &Displacement, h: f64) {
        let (from, to) = (self.coordinates(&self.still), self.coordinates(still));
        for k in 0..3 {
            self.pose[k] = match &mut self.modes {
                Some(modes) => modes[k].advance(
                    self.pose[k],
                    &Course {
                        from: from[k],
                        to: to[k],
                    },
                    h,
                ),
                None => to[k],
            };
        }
    }

    /// Piston and tilts of a rigid plate whose four edges the actuators hold alike.
    fn coordinates(&self, moved: &Displacement) -> [Flow; 3] {
        let across = 0.5 / self.lever;
        let of = |pick: &dyn Fn(&Lanes) -> f64| Flow {
            value: pick(&moved.value),
            rate: pick(&moved.rate),
        };
        [
            of(&|d| 0.25 * d.sum()),
            of(&|d| across * (d.0[1] - d.0[3])),
            of(&|d| across * (d.0[0] - d.0[2])),
        ]
    }
}
