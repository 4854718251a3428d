//! The control core's chain once more, in f64, written from the stages' equations: what the core's f32 arithmetic is
//! judged by.
//!
//! It is told what the core is told: positions, and the drives and currents of the tick that ended. A state here is the
//! physical quantity itself; nothing is rearranged for speed.

use control_core::calibration::{
    ActuatorCalibration, Calibration, FAST_POLES, Heat, LAGS, Lag, Memory, PLAYS, Parts, SLOW_POLES,
};
use control_core::resistance::MIN_SENSE_DRIVE;
use control_core::shape::SEGMENTS;
use control_core::{Ampere, CHANNELS, Micrometre, Setpoint, Volt};

/// Length of a tick (s).
const TICK_S: f64 = 1e-4;
/// Slow lags, plays and creep have their turn in every fourth tick.
const TURNS: usize = 4;
/// A current that is none (A).
const NO_CURRENT_A: f32 = 1e-6;
/// A sensed resistance may be so far from the model's.
const PLAUSIBLE: f64 = 0.25;
/// Part of the way to a new reading that the correction goes in a tick.
const PACE: f64 = 0.125;
/// Time constant with which an actuator catches up that a bound has held back, as part of a move.
const CATCHING_UP: f64 = 0.25;

/// The chain from positions to volts.
pub(crate) struct Chain {
    path: Path,
    memory: Hysteresis,
    actuators: [Actuator; CHANNELS],
    top_um: f64,
    hottest_um: f64,
    turn: usize,
}

/// A polynomial of fifth order from where the mirror is to a target, at rest there.
struct Path {
    ticks: f64,
    target: f64,
    /// Ticks since the move began.
    passed: f64,
    /// Distance from the target, in powers of the part of the move that is done.
    course: [f64; 6],
    now: f64,
}

/// Hysteresis and creep inverted.
struct Hysteresis {
    /// What is left of the motion without plays, inverted.
    slope: f64,
    radius: [f64; PLAYS],
    weight: [f64; PLAYS],
    held: [f64; PLAYS],
    release: f64,
    creep: [Relaxing; LAGS],
    turn: usize,
}

/// A first-order lag with its weight, and where it is.
#[derive(Clone, Copy, Debug)]
struct Relaxing {
    weight: f64,
    /// What is left of a distance after its step.
    keeps: f64,
    at: f64,
}

/// One actuator.
struct Actuator {
    calibration: ActuatorCalibration,
    poles: Poles,
    drive_limit_v: f64,
    power_limit_w: f64,
    rise: f64,
    /// What it is to be short of what it is asked for, and what a tick leaves of that.
    lag: f64,
    keeps: f64,
    expected_ohm: f64,
    correction: f64,
    /// The mirror under the core's drive instead, with the same resistance.
    twin: Twin,
}

/// The thermal poles of one actuator.
#[derive(Clone, Debug)]
struct Poles {
    fast: [Relaxing; FAST_POLES],
    slow: [Relaxing; SLOW_POLES],
    /// Heating since the slow ones' turn.
    heating: f64,
}

/// Poles that a power drives.
#[derive(Clone, Debug)]
struct Twin {
    poles: Poles,
    rise: f64,
}

/// How far the core is from this chain in one tick, the furthest lane (um).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Apart {
    /// Where the two drives would hold the mirror.
    pub(crate) drive_um: f64,
    /// Where the two drives have taken it.
    pub(crate) mirror_um: f64,
}

impl Chain {
    /// A chain at rest.
    pub(crate) fn new(calibration: &Calibration) -> Self {
        let parts = calibration.parts();
        Self {
            path: Path::new(f64::from(parts.path.move_time.0)),
            memory: Hysteresis::new(&parts.memory),
            actuators: parts.actuators.map(|lane| Actuator::new(lane, parts)),
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
        for (i, lane) in self.actuators.iter_mut().enumerate() {
            lane.sense(applied[i], currents[i]);
        }
        let within = |z: Micrometre| f64::from(z.0).clamp(0.0, self.top_um);
        let z = match setpoint {
            Setpoint::Position(z) => self.path.toward(within(z)),
            Setpoint::Track(z) => self.path.follow(within(z)),
            Setpoint::Off | Setpoint::Drive(_) => panic!("no position"),
        };
        let x = self.memory.displacement(z).min(self.hottest_um);
        let mut apart = Apart::default();
        for (lane, drive) in self.actuators.iter_mut().zip(drives) {
            let one = lane.heat_to(x, f64::from(drive.0));
            apart.drive_um = apart.drive_um.max(one.drive_um);
            apart.mirror_um = apart.mirror_um.max(one.mirror_um);
        }
        self.actuators[self.turn].relax_slow();
        self.turn = (self.turn + 1) % TURNS;
        apart
    }
}

impl Path {
    fn new(move_s: f64) -> Self {
        Self {
            ticks: (move_s / TICK_S).max(1.0),
            target: 0.0,
            passed: f64::INFINITY,
            course: [0.0; 6],
            now: 0.0,
        }
    }

    fn follow(&mut self, z: f64) -> f64 {
        (self.now, self.target, self.passed) = (z, z, f64::INFINITY);
        z
    }

    fn toward(&mut self, target: f64) -> f64 {
        if target != self.target {
            self.course = self.bent_to(target);
            (self.target, self.passed) = (target, 0.0);
        }
        self.passed += 1.0;
        let done = self.passed / self.ticks;
        // A move that has lasted whole ticks but for rounding is over.
        self.now = self.target
            + if done < 1.0 - 1e-9 {
                derivative(&self.course, 0, done)
            } else {
                0.0
            };
        self.now
    }

    /// From the present position, speed and acceleration to `target`, with neither speed nor acceleration there.
    fn bent_to(&self, target: f64) -> [f64; 6] {
        let done = self.passed / self.ticks;
        let moving = |order| {
            if done < 1.0 - 1e-9 {
                derivative(&self.course, order, done)
            } else {
                0.0
            }
        };
        let (p, v, a) = (self.now - target, moving(1), moving(2));
        [
            p,
            v,
            a / 2.0,
            -10.0 * p - 6.0 * v - 1.5 * a,
            15.0 * p + 8.0 * v + 1.5 * a,
            -6.0 * p - 3.0 * v - 0.5 * a,
        ]
    }
}

/// A derivative of a polynomial.
fn derivative(polynomial: &[f64; 6], order: usize, at: f64) -> f64 {
    let term = |k: usize| {
        let falling: usize = (k + 1 - order..=k).product();
        polynomial[k] * falling as f64 * at.powi((k - order) as i32)
    };
    (order..6).map(term).sum()
}

impl Hysteresis {
    /// The inverse has a play where the virgin curve of the memory bends, and there its slope inverted.
    fn new(memory: &Memory) -> Self {
        let weights = memory.plays.map(|play| f64::from(play.weight));
        let radii = memory.plays.map(|play| f64::from(play.radius.0));
        let at_once = 1.0 - weights.iter().sum::<f64>();
        let slope_behind = |k: usize| at_once + weights[..k].iter().sum::<f64>();
        let reached = |k: usize| {
            let plays = weights[..k].iter().zip(&radii);
            let pulled = plays.map(|(weight, radius)| weight * (radii[k] - radius));
            at_once * radii[k] + pulled.sum::<f64>()
        };
        let release_s = f64::from(memory.release.0);
        Self {
            slope: 1.0 / at_once,
            radius: std::array::from_fn(reached),
            weight: std::array::from_fn(|k| 1.0 / slope_behind(k + 1) - 1.0 / slope_behind(k)),
            held: [0.0; PLAYS],
            release: if release_s > 0.0 {
                keeps(release_s, TURNS)
            } else {
                1.0
            },
            creep: memory.creep.map(|lag| Relaxing::new(lag, TURNS)),
            turn: 0,
        }
    }

    fn displacement(&mut self, z: f64) -> f64 {
        let crept: f64 = self.creep.iter().map(|lag| lag.at).sum();
        let y = z - crept;
        self.creep[self.turn].relax(y);
        let held = &mut self.held[self.turn];
        *held = y + (*held - y) * self.release;
        self.turn = (self.turn + 1) % TURNS;
        let mut x = self.slope * y;
        for k in 0..PLAYS {
            self.held[k] = self.held[k].clamp(y - self.radius[k], y + self.radius[k]);
            x += self.weight[k] * self.held[k];
        }
        x
    }
}

/// What is left of a distance after so many ticks.
fn keeps(time_s: f64, ticks: usize) -> f64 {
    if time_s > 0.0 {
        (-TICK_S * ticks as f64 / time_s).exp()
    } else {
        0.0
    }
}

impl Relaxing {
    fn new(lag: Lag, ticks: usize) -> Self {
        Self {
            weight: f64::from(lag.weight),
            keeps: keeps(f64::from(lag.time.0), ticks),
            at: 0.0,
        }
    }

    fn relax(&mut self, input: f64) {
        self.at = self.after(input);
    }

    fn after(&self, input: f64) -> f64 {
        let goal = self.weight * input;
        goal + (self.at - goal) * self.keeps
    }
}

impl Poles {
    fn new(heat: &Heat) -> Self {
        Self {
            fast: heat.fast.map(|lag| Relaxing::new(lag, 1)),
            slow: heat.slow.map(|lag| Relaxing::new(lag, TURNS)),
            heating: 0.0,
        }
    }

    /// The temperature rise after a tick with `heating`.
    fn after(&self, heating: f64) -> f64 {
        let fast: f64 = self.fast.iter().map(|lag| lag.after(heating)).sum();
        fast + self.slow.iter().map(|lag| lag.at).sum::<f64>()
    }

    /// The heating after which it is `target`: the rise is linear in it.
    fn inverse(&self, target: f64) -> f64 {
        let coasting = self.after(0.0);
        (target - coasting) / (self.after(1.0) - coasting)
    }

    /// A tick; returns the rise at its end.
    fn tick(&mut self, heating: f64) -> f64 {
        let rise = self.after(heating);
        for lag in &mut self.fast {
            lag.relax(heating);
        }
        self.heating += heating;
        rise
    }

    fn relax_slow(&mut self) {
        let mean = self.heating / TURNS as f64;
        for lag in &mut self.slow {
            lag.relax(mean);
        }
        self.heating = 0.0;
    }
}

impl Actuator {
    fn new(calibration: ActuatorCalibration, parts: &Parts) -> Self {
        let poles = Poles::new(&parts.heat);
        Self {
            calibration,
            drive_limit_v: f64::from(parts.bounds.drive.0),
            power_limit_w: f64::from(parts.bounds.power.0),
            rise: 0.0,
            lag: 0.0,
            keeps: keeps(CATCHING_UP * f64::from(parts.path.move_time.0), 1),
            expected_ohm: f64::from(calibration.cold_resistance.0),
            correction: 1.0,
            twin: Twin {
                poles: poles.clone(),
                rise: 0.0,
            },
            poles,
        }
    }

    fn sense(&mut self, applied: Volt, current: Ampere) {
        if applied.0 < MIN_SENSE_DRIVE.0 || current.0 <= NO_CURRENT_A {
            return;
        }
        let ohm = f64::from(applied.0) / f64::from(current.0);
        let ratio = ohm / self.expected_ohm;
        self.correction = if (ratio - 1.0).abs() < PLAUSIBLE {
            self.correction + PACE * (ratio - self.correction)
        } else {
            1.0
        };
    }

    /// A tick that is to end at the displacement `x_um`, beside the drive of the core.
    fn heat_to(&mut self, x_um: f64, core_v: f64) -> Apart {
        let target = rise_k(&self.calibration, x_um);
        self.expected_ohm = resistance_ohm(&self.calibration, self.rise);
        let ohm = self.expected_ohm * self.correction;
        let r_t = f64::from(self.calibration.thermal_resistance.0);
        let growth = f64::from(self.calibration.loss_growth.0);
        let aim = target - self.lag;
        let mut heating = self.poles.inverse(aim);
        let asked_w = (heating + growth * aim * aim) / r_t;
        let most_w = self.power_limit_w.min(self.drive_limit_v.powi(2) / ohm);
        let power_w = asked_w.clamp(0.0, most_w);
        if power_w != asked_w {
            heating = power_w * r_t - growth * self.rise * self.rise;
        }
        let drive_v = (power_w * ohm).sqrt();
        self.rise = self.poles.tick(heating);
        self.lag = self.keeps * (target - self.rise);

        // What the core's drive does differs by this power.
        let more_w = (core_v * core_v - drive_v * drive_v) / ohm;
        let twin = &mut self.twin;
        twin.rise = twin.poles.tick(heating + more_w * r_t);
        let place = |rise| position_um(&self.calibration, rise);
        Apart {
            drive_um: (rest_um(&self.calibration, core_v) - rest_um(&self.calibration, drive_v))
                .abs(),
            mirror_um: (place(twin.rise) - place(self.rise)).abs(),
        }
    }

    fn relax_slow(&mut self) {
        self.poles.relax_slow();
        self.twin.poles.relax_slow();
    }
}

fn knot(lane: &ActuatorCalibration, i: usize) -> (f64, f64) {
    let top_um = f64::from(lane.shape.top().0);
    let z_um = top_um * i as f64 / SEGMENTS as f64;
    (z_um, f64::from(lane.shape.knots()[i]))
}

/// Along a straight line through two points.
fn line((x0, y0): (f64, f64), (x1, y1): (f64, f64), x: f64) -> f64 {
    y0 + (x - x0) / (x1 - x0) * (y1 - y0)
}

/// The table; beyond its ends, its ends.
fn rise_k(lane: &ActuatorCalibration, z_um: f64) -> f64 {
    let top_um = f64::from(lane.shape.top().0);
    let z_um = z_um.clamp(0.0, top_um);
    let segment = ((z_um / top_um * SEGMENTS as f64) as usize).min(SEGMENTS - 1);
    line(knot(lane, segment), knot(lane, segment + 1), z_um)
}

/// The table read forward, straight on beyond its ends.
fn position_um(lane: &ActuatorCalibration, rise_k: f64) -> f64 {
    let above = (1..SEGMENTS).find(|&i| knot(lane, i).1 > rise_k);
    let segment = above.unwrap_or(SEGMENTS) - 1;
    let turned = |i: usize| {
        let (z_um, rise_k) = knot(lane, i);
        (rise_k, z_um)
    };
    line(turned(segment), turned(segment + 1), rise_k)
}

/// Where a drive holds the mirror, by the table: a straight line in its square from knot to knot, and beyond the last.
fn rest_um(lane: &ActuatorCalibration, volts: f64) -> f64 {
    let r_t = f64::from(lane.thermal_resistance.0);
    let growth = f64::from(lane.loss_growth.0);
    let point = |i: usize| {
        let (z_um, rise) = knot(lane, i);
        let power_w = rise * (1.0 + growth * rise) / r_t;
        (power_w * resistance_ohm(lane, rise), z_um)
    };
    let square = volts * volts;
    // The squares rise with the knots.
    let (mut low, mut high) = (0, SEGMENTS);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if point(middle).0 <= square {
            low = middle;
        } else {
            high = middle;
        }
    }
    line(point(low), point(low + 1), square)
}

fn resistance_ohm(lane: &ActuatorCalibration, rise_k: f64) -> f64 {
    f64::from(lane.cold_resistance.0) * (1.0 + f64::from(lane.tcr.0) * rise_k)
}

/// Where the first lane is as hot as is allowed.
fn hottest_um(parts: &Parts) -> f64 {
    let limit = f64::from(parts.bounds.rise.0);
    let reached = parts.actuators.iter();
    reached
        .filter(|lane| knot(lane, SEGMENTS).1 > limit)
        .map(|lane| position_um(lane, limit))
        .fold(f64::INFINITY, f64::min)
}
