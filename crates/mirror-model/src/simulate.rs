//! The model in time: four actuators on the drives of a measurement, with thermal poles and effects.

use crate::effect::{Active, Acts, Moment, Step};
use crate::{ACTUATORS, Deflection, Model, Parameters};
use thiserror::Error;

/// Thermal poles of an actuator.
const POLES: usize = 3;
/// No fixed point of power and temperature takes more rounds than this.
const ROUNDS: usize = 12;
/// Temperatures that agree so well are the same.
const SAME_K: f64 = 1e-5;
/// A temperature rise beyond this is a runaway: everything has melted.
const RUNAWAY_K: f64 = 5e3;

/// A piece of drive: held where both ends are equal, a straight line otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// How long it lasts.
    pub duration_s: f64,
    /// The drives at its start.
    pub from_v: [f64; ACTUATORS],
    /// The drives at its end.
    pub to_v: [f64; ACTUATORS],
}

/// What the model shows at the end of an interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// The displacement as the sensor reads it, counted from rest.
    pub z_um: f64,
    /// The current of each actuator; 0 where it is not driven.
    pub current_a: [f64; ACTUATORS],
    /// The temperature rise of each actuator.
    pub temperature_rise_k: [f64; ACTUATORS],
}

/// The model has no finite answer.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the model runs away at {t_s:.3} s: {what}")]
pub struct Runaway {
    /// Time from the start of the simulation.
    pub t_s: f64,
    /// What became infinite, or not a number.
    pub what: String,
}

/// Runs the model from rest over the intervals, one output at the end of each.
///
/// `resolution` is the longest step in units of the time since the last jump of the drive (and of the fastest pole just
/// after it): 0.3 is good to some nanometres; halving it tells how good.
///
/// # Errors
/// [`Runaway`] when something stops being finite, as a user's formula can make it.
pub fn simulate(
    model: &Model,
    intervals: &[Interval],
    resolution: f64,
) -> Result<Vec<Output>, Runaway> {
    let mut simulation = Simulation::new(model, resolution);
    intervals
        .iter()
        .map(|interval| simulation.run(interval))
        .collect()
}

/// A first-order lag over one step with an input that runs straight, ready to be used again and again.
#[derive(Clone, Copy)]
struct Lag {
    keeps: f64,
    takes_start: f64,
    takes_end: f64,
}

impl Lag {
    fn new(tau_s: f64, h: f64) -> Self {
        if tau_s < 1e-9 || h <= 0.0 {
            return Self {
                keeps: 0.0,
                takes_start: 0.0,
                takes_end: 1.0,
            };
        }
        let keeps = (-h / tau_s).exp();
        let mean = tau_s / h * (1.0 - keeps);
        Self {
            keeps,
            takes_start: mean - keeps,
            takes_end: 1.0 - mean,
        }
    }

    fn after(&self, x: f64, from: f64, to: f64) -> f64 {
        self.keeps * x + self.takes_start * from + self.takes_end * to
    }
}

/// The lags of every lane's poles over a step; most lanes have the same.
fn lags(lanes: &[Lane; ACTUATORS], h: f64) -> [[Lag; POLES]; ACTUATORS] {
    let first = lanes[0].taus_s.map(|tau| Lag::new(tau, h));
    std::array::from_fn(|index| {
        if lanes[index].taus_s == lanes[0].taus_s {
            first
        } else {
            lanes[index].taus_s.map(|tau| Lag::new(tau, h))
        }
    })
}

/// Finds the fixed point of a function by secants. Where a strong heat loss makes every round overshoot, going from
/// value to value would run away.
#[derive(Clone, Copy)]
struct Secant {
    /// Slope of the function where no two values are known yet.
    usual_slope: f64,
    last: Option<(f64, f64)>,
}

impl Secant {
    fn new(usual_slope: f64) -> Self {
        Self {
            usual_slope,
            last: None,
        }
    }

    /// The next guess, when the function has this value at the last one.
    fn next(&mut self, guess: f64, value: f64) -> f64 {
        let off = value - guess;
        let before = self.last.replace((guess, off));
        let Some((guess_before, off_before)) = before else {
            return guess + off / (1.0 - self.usual_slope);
        };
        let slope = (off - off_before) / (guess - guess_before);
        // Falling, as it is where a fixed point attracts in time; anything else is noise of equal guesses.
        if slope < -1e-3 && slope.is_finite() {
            guess - off / slope
        } else {
            value
        }
    }
}

struct Lane {
    parameters: Parameters,
    weights: [f64; POLES],
    taus_s: [f64; POLES],
    poles_k: [f64; POLES],
    heating_k: f64,
    now: Moment,
    current_a: f64,
}

/// An effect with its states and last inputs, by lane.
struct Running<'a> {
    active: &'a Active,
    acts: Acts,
    states: Vec<Vec<f64>>,
    inputs: Vec<f64>,
}

struct Simulation<'a> {
    lanes: [Lane; ACTUATORS],
    effects: Vec<Running<'a>>,
    resolution: f64,
    fastest_s: f64,
    t_s: f64,
    since_jump_s: f64,
    last_v: [f64; ACTUATORS],
    /// Displacement of the centre without sensor effects, and what it was at rest.
    centre_um: f64,
    rest_um: f64,
    reading_um: f64,
}

impl<'a> Simulation<'a> {
    fn new(model: &'a Model, resolution: f64) -> Self {
        let effects = model.effects.iter().map(Running::new).collect();
        let lanes = std::array::from_fn(|index| Lane::new(model.actuator(index).parameters));
        let fastest_s = lanes
            .iter()
            .map(|lane: &Lane| lane.taus_s[0])
            .fold(f64::INFINITY, f64::min)
            .max(1e-5);
        let mut simulation = Self {
            lanes,
            effects,
            resolution,
            fastest_s,
            t_s: 0.0,
            since_jump_s: 0.0,
            last_v: [0.0; ACTUATORS],
            centre_um: 0.0,
            rest_um: 0.0,
            reading_um: 0.0,
        };
        simulation.settle_at_rest();
        simulation
    }

    /// Shape effects may move the cold mirror; z is counted from there, and no state shall see it as a step.
    fn settle_at_rest(&mut self) {
        self.heat([0.0; ACTUATORS], 0.0);
        self.shape(0.0);
        self.rest_um = self.centre_um;
        self.shape(0.0);
    }

    fn run(&mut self, interval: &Interval) -> Result<Output, Runaway> {
        let mut done_s = 0.0;
        if interval.from_v != self.last_v {
            self.since_jump_s = 0.0;
        }
        let held = interval.from_v == interval.to_v;
        while done_s < interval.duration_s {
            let left = interval.duration_s - done_s;
            let h = self.step_s(held, interval.duration_s).min(left);
            let h = if left - h < 1e-9 * interval.duration_s {
                left
            } else {
                h
            };
            let share = (done_s + h) / interval.duration_s;
            let voltage = std::array::from_fn(|i| {
                interval.from_v[i] + share * (interval.to_v[i] - interval.from_v[i])
            });
            if done_s == 0.0 {
                self.heat(interval.from_v, 0.0);
            }
            self.t_s += h;
            self.heat(voltage, h);
            self.shape(h);
            self.check()?;
            self.since_jump_s += h;
            done_s += h;
        }
        self.last_v = interval.to_v;
        Ok(self.output())
    }

    fn step_s(&self, held: bool, interval_s: f64) -> f64 {
        if held {
            self.resolution * (self.since_jump_s + self.fastest_s)
        } else {
            interval_s * (2.0 * self.resolution).min(1.0)
        }
    }

    /// Moves the temperatures on by `h`, so that power and temperature agree at its end. With `h` = 0 only the power
    /// changes.
    fn heat(&mut self, voltage_v: [f64; ACTUATORS], h: f64) {
        let lags = lags(&self.lanes, h);
        let start: [_; ACTUATORS] = std::array::from_fn(|i| {
            let lane = &self.lanes[i];
            (lane.poles_k, lane.heating_k)
        });
        let mut secants: [_; ACTUATORS] =
            std::array::from_fn(|i| Secant::new(self.lanes[i].attraction(&lags[i])));
        for _ in 0..ROUNDS {
            let powers_w = self.lanes.each_ref().map(|lane| lane.now.power_w);
            let (mut moved_k, mut off_k): (f64, f64) = (0.0, 0.0);
            for (index, lane) in self.lanes.iter_mut().enumerate() {
                let before_k = lane.now.temperature_rise_k;
                let guess = lane.heating_k;
                lane.now.t_s = self.t_s;
                lane.now.total_power_w = powers_w.iter().sum();
                lane.now.opposite_power_w = powers_w[(index + ACTUATORS / 2) % ACTUATORS];
                let (poles, heating) = &start[index];
                if h > 0.0 {
                    let heating_now = lane.heating_k;
                    lane.poles_k = std::array::from_fn(|k| {
                        lags[index][k].after(poles[k], *heating, heating_now)
                    });
                }
                lane.electrical(index, voltage_v[index], &self.effects);
                moved_k = moved_k.max((lane.now.temperature_rise_k - before_k).abs());
                off_k = off_k.max((lane.heating_k - guess).abs());
                lane.heating_k = secants[index].next(guess, lane.heating_k);
            }
            // Without effects no lane waits for what the others' powers come to.
            if off_k < SAME_K && (moved_k < SAME_K || self.effects.is_empty()) {
                break;
            }
        }
        if h > 0.0 {
            for (index, lane) in self.lanes.iter().enumerate() {
                let raw = lane.raw_temperature();
                advance(
                    &mut self.effects,
                    &[Acts::Voltage, Acts::Resistance, Acts::Heating],
                    index,
                    lane.heating_k,
                    &lane.now,
                    h,
                );
                advance(
                    &mut self.effects,
                    &[Acts::Temperature],
                    index,
                    raw,
                    &lane.now,
                    h,
                );
            }
        }
    }

    fn shape(&mut self, h: f64) {
        let mut sum_um = 0.0;
        for (index, lane) in self.lanes.iter_mut().enumerate() {
            let p = &lane.parameters;
            let plain = Deflection::curvature_per_um(p, lane.now.temperature_rise_k);
            advance(
                &mut self.effects,
                &[Acts::Curvature],
                index,
                plain,
                &lane.now,
                h,
            );
            let curvature = change(&self.effects, Acts::Curvature, index, plain, &lane.now);
            lane.now.z_um = Deflection::of(p, curvature).z_um;
            advance(
                &mut self.effects,
                &[Acts::Displacement],
                index,
                lane.now.z_um,
                &lane.now,
                h,
            );
            sum_um += change(
                &self.effects,
                Acts::Displacement,
                index,
                lane.now.z_um,
                &lane.now,
            );
        }
        let mut moment = self.lanes[0].now;
        moment.z_um = sum_um / ACTUATORS as f64;
        advance(
            &mut self.effects,
            &[Acts::Motion],
            0,
            moment.z_um,
            &moment,
            h,
        );
        self.centre_um = change(&self.effects, Acts::Motion, 0, moment.z_um, &moment);
        let counted = self.centre_um - self.rest_um;
        moment.z_um = counted;
        advance(&mut self.effects, &[Acts::Reading], 0, counted, &moment, h);
        self.reading_um = change(&self.effects, Acts::Reading, 0, counted, &moment);
    }

    fn check(&self) -> Result<(), Runaway> {
        let hot = self
            .lanes
            .iter()
            .map(|lane| lane.now.temperature_rise_k)
            .find(|rise| rise.is_nan() || rise.abs() > RUNAWAY_K);
        let what = match hot {
            Some(rise) => format!("a temperature rise of {rise:.3e} K"),
            None if !self.reading_um.is_finite() => {
                format!("a displacement of {} um", self.reading_um)
            }
            None => return Ok(()),
        };
        Err(Runaway {
            t_s: self.t_s,
            what,
        })
    }

    fn output(&self) -> Output {
        Output {
            z_um: self.reading_um,
            current_a: std::array::from_fn(|i| self.lanes[i].current_a),
            temperature_rise_k: std::array::from_fn(|i| self.lanes[i].now.temperature_rise_k),
        }
    }
}

impl Lane {
    fn new(parameters: Parameters) -> Self {
        let p = &parameters;
        let moment = Moment {
            resistance_ohm: p.cold_resistance_ohm,
            cold_resistance_ohm: p.cold_resistance_ohm,
            thermal_resistance_k_per_w: p.thermal_resistance_k_per_w,
            curvature_per_k: Deflection::curvature_per_um(p, 1.0),
            ..Moment::default()
        };
        Self {
            weights: [
                1.0 - p.middle_weight - p.slow_weight,
                p.middle_weight,
                p.slow_weight,
            ],
            taus_s: [p.fast_s, p.middle_s, p.slow_s],
            poles_k: [0.0; POLES],
            heating_k: 0.0,
            now: moment,
            current_a: 0.0,
            parameters,
        }
    }

    /// How much the heating at the end of a step changes with the heating that was assumed there: a hotter heater has more
    /// resistance and takes less power.
    fn attraction(&self, lags: &[Lag; POLES]) -> f64 {
        let arrives: f64 = self
            .weights
            .iter()
            .zip(lags)
            .map(|(weight, lag)| weight * lag.takes_end)
            .sum();
        let p = &self.parameters;
        -arrives * self.heating_k * p.cold_resistance_ohm * p.resistance_coefficient_per_k
            / self.now.resistance_ohm
    }

    fn raw_temperature(&self) -> f64 {
        self.weights
            .iter()
            .zip(self.poles_k)
            .map(|(weight, pole)| weight * pole)
            .sum()
    }

    /// From the temperatures to resistance, current, power and heating.
    fn electrical(&mut self, index: usize, voltage_v: f64, effects: &[Running]) {
        let p = &self.parameters;
        let raw = self.raw_temperature();
        let now = &mut self.now;
        now.voltage_v = voltage_v;
        now.temperature_rise_k = change(effects, Acts::Temperature, index, raw, now);
        now.grown_resistance_ohm =
            p.cold_resistance_ohm * p.resistance_coefficient_per_k * now.temperature_rise_k;
        now.resistance_ohm = p.cold_resistance_ohm + now.grown_resistance_ohm;
        now.resistance_ohm =
            change(effects, Acts::Resistance, index, now.resistance_ohm, now).max(1e-3);
        let heater_v = change(effects, Acts::Voltage, index, voltage_v, now);
        self.current_a = heater_v / now.resistance_ohm;
        now.power_w = heater_v * self.current_a;
        self.heating_k = change(
            effects,
            Acts::Heating,
            index,
            p.thermal_resistance_k_per_w * now.power_w,
            now,
        );
    }
}

impl<'a> Running<'a> {
    fn new(active: &'a Active) -> Self {
        let lanes = if active.effect.info().acts.on_the_mirror() {
            1
        } else {
            ACTUATORS
        };
        let states = vec![vec![0.0; active.effect.states()]; lanes];
        Self {
            active,
            acts: active.effect.info().acts,
            states,
            inputs: vec![f64::NAN; lanes],
        }
    }
}

/// The quantity with every effect that acts on it, one after the other.
fn change(effects: &[Running], acts: Acts, lane: usize, plain: f64, moment: &Moment) -> f64 {
    effects
        .iter()
        .filter(|running| running.acts == acts)
        .fold(plain, |value, r| {
            r.active
                .effect
                .output(&r.active.values, value, &r.states[lane], moment)
        })
}

/// Moves the states of the effects on these quantities on by `h`. A first call, with `h` = 0, only notes the input.
fn advance(
    effects: &mut [Running],
    acts: &[Acts],
    lane: usize,
    plain: f64,
    moment: &Moment,
    h: f64,
) {
    let mut value = plain;
    for r in effects
        .iter_mut()
        .filter(|running| acts.contains(&running.acts))
    {
        let (effect, values) = (&r.active.effect, &r.active.values);
        if h > 0.0 && effect.states() > 0 {
            let from = if r.inputs[lane].is_nan() {
                value
            } else {
                r.inputs[lane]
            };
            effect.advance(
                values,
                &mut r.states[lane],
                &Step {
                    from,
                    to: value,
                    duration_s: h,
                    moment: *moment,
                },
            );
        }
        r.inputs[lane] = value;
        value = effect.output(values, value, &r.states[lane], moment);
    }
}
