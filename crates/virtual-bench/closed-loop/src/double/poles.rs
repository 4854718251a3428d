//! First-order low-passes, and the Foster network of thermal poles that they make.

use control_core::CHANNELS;
use control_core::calibration::{FAST_POLES, Heat, Lag, POLES, Parts, SLOW_POLES};

use crate::TICK_S;

/// Slow poles have their turn in every fourth tick.
pub(super) const TURNS: usize = 4;

/// A first-order low-pass with its weight, and where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pole {
    weight: f64,
    /// What is left of a distance after its step: the pole in the z plane.
    pole: f64,
    pub(super) at: f64,
}

/// A beam behind its heater: a low-pass whose input goes straight in every tick.
#[derive(Clone, Debug)]
pub(super) struct Beam {
    pub(super) lag_ticks: f64,
    /// What a tick leaves of a distance.
    pole: f64,
    heater: f64,
    rise: f64,
}

/// The thermal poles of one actuator, each without the part that the watts of all four drive.
#[derive(Clone, Debug)]
pub(super) struct Poles {
    fast: [Pole; FAST_POLES],
    slow: [Pole; SLOW_POLES],
    /// What that part was told to be at the last turn.
    shared: f64,
    /// Heating since the slow ones' turn.
    heating: f64,
}

/// The parts that the watts of all four drive: of every pole but the first, one of which has its turn in each tick.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    poles: [Pole; POLES - 1],
    /// Of all watts that hold the four equally warm, those of each.
    watts: [f64; CHANNELS],
    /// Where each will be so many ticks later: what is made of heating is told as late.
    told: [f64; POLES - 1],
    heating: f64,
    turns: f64,
}

/// How late, in ticks.
const LATE: f64 = 6.0;

/// What is left of a distance after so many ticks: the pole in the z plane of a low-pass with this time constant.
pub(super) fn pole(time_s: f64, ticks: usize) -> f64 {
    if time_s > 0.0 {
        (-TICK_S * ticks as f64 / time_s).exp()
    } else {
        0.0
    }
}

impl Pole {
    pub(super) fn new(low_pass: Lag, ticks: usize) -> Self {
        Self {
            weight: f64::from(low_pass.weight),
            pole: pole(f64::from(low_pass.time.0), ticks),
            at: 0.0,
        }
    }

    pub(super) fn relax(&mut self, input: f64) {
        self.at = self.after(input);
    }

    pub(super) fn after(&self, input: f64) -> f64 {
        let goal = self.weight * input;
        goal + (self.at - goal) * self.pole
    }
}

impl Beam {
    pub(super) fn new(heat: &Heat) -> Self {
        Self {
            lag_ticks: f64::from(heat.beam_lag.0) / TICK_S,
            pole: pole(f64::from(heat.beam_lag.0), 1),
            heater: 0.0,
            rise: 0.0,
        }
    }

    /// A tick at whose end the heater is at `heater`; returns the beam's rise then.
    pub(super) fn follow(&mut self, heater: f64) -> f64 {
        // The ramp's own answer is the ramp, late by the lag; what is off it decays.
        let slope = heater - self.heater;
        let late = |at: f64| at - self.lag_ticks * slope;
        self.rise = late(heater) + self.pole * (self.rise - late(self.heater));
        self.heater = heater;
        self.rise
    }
}

impl Poles {
    pub(super) fn new(heat: &Heat) -> Self {
        let own = |k: usize, ticks| Pole::new(weighed(heat, k, 1.0 - heat.shared[k]), ticks);
        Self {
            fast: std::array::from_fn(|k| own(k, 1)),
            slow: std::array::from_fn(|k| own(FAST_POLES + k, TURNS)),
            shared: 0.0,
            heating: 0.0,
        }
    }

    /// The temperature rise after a tick with `heating`.
    pub(super) fn after(&self, heating: f64) -> f64 {
        let fast: f64 = self.fast.iter().map(|pole| pole.after(heating)).sum();
        fast + self.slow.iter().map(|pole| pole.at).sum::<f64>() + self.shared
    }

    /// The heating after which it is `target`: the rise is linear in it.
    pub(super) fn inverse(&self, target: f64) -> f64 {
        (target - self.after(0.0)) / self.gain()
    }

    /// What a tick makes of a heating.
    pub(super) fn gain(&self) -> f64 {
        self.after(1.0) - self.after(0.0)
    }

    /// A tick; returns the rise at its end.
    pub(super) fn tick(&mut self, heating: f64) -> f64 {
        let rise = self.after(heating);
        for pole in &mut self.fast {
            pole.relax(heating);
        }
        self.heating += heating;
        rise
    }

    /// Mean heating since the last turn.
    pub(super) fn heating(&self) -> f64 {
        self.heating / TURNS as f64
    }

    pub(super) fn relax_slow(&mut self, shared: f64) {
        let mean = self.heating();
        for pole in &mut self.slow {
            pole.relax(mean);
        }
        self.shared = shared;
        self.heating = 0.0;
    }
}

impl Shared {
    pub(super) fn new(parts: &Parts) -> Self {
        let heat = &parts.heat;
        let watts = parts
            .actuators
            .map(|it| 1.0 / f64::from(it.thermal_resistance.0));
        let sum: f64 = watts.iter().sum();
        let shared = |k: usize| Pole::new(weighed(heat, k + 1, heat.shared[k + 1]), TURNS);
        Self {
            poles: std::array::from_fn(shared),
            watts: watts.map(|one| one / sum),
            told: [0.0; POLES - 1],
            heating: 0.0,
            turns: 0.0,
        }
    }

    /// The turn of one pole, and of the actuator with this mean heating; returns what all actuators share then.
    pub(super) fn turn(&mut self, turn: usize, mean: f64) -> f64 {
        let pole = &mut self.poles[turn];
        pole.relax(self.heating);
        self.told[turn] = pole.at + LATE / TURNS as f64 * (pole.after(self.heating) - pole.at);
        self.turns += self.watts[turn] * mean;
        if turn + 1 == CHANNELS {
            self.heating = self.turns;
            self.turns = 0.0;
        }
        self.told.iter().sum()
    }
}

/// A part of a pole.
fn weighed(heat: &Heat, k: usize, part: f32) -> Lag {
    let lag = heat.poles()[k];
    Lag {
        weight: part * lag.weight,
        ..lag
    }
}
