//! First-order low-passes, and the Foster network of thermal poles that they make.

use control_core::calibration::{FAST_POLES, Heat, Lag, SLOW_POLES};

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

/// The thermal poles of one actuator.
#[derive(Clone, Debug)]
pub(super) struct Poles {
    fast: [Pole; FAST_POLES],
    slow: [Pole; SLOW_POLES],
    /// Heating since the slow ones' turn.
    heating: f64,
}

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

impl Poles {
    pub(super) fn new(heat: &Heat) -> Self {
        Self {
            fast: heat.fast.map(|lag| Pole::new(lag, 1)),
            slow: heat.slow.map(|lag| Pole::new(lag, TURNS)),
            heating: 0.0,
        }
    }

    /// The temperature rise after a tick with `heating`.
    pub(super) fn after(&self, heating: f64) -> f64 {
        let fast: f64 = self.fast.iter().map(|pole| pole.after(heating)).sum();
        fast + self.slow.iter().map(|pole| pole.at).sum::<f64>()
    }

    /// The heating after which it is `target`: the rise is linear in it.
    pub(super) fn inverse(&self, target: f64) -> f64 {
        let free_response = self.after(0.0);
        (target - free_response) / (self.after(1.0) - free_response)
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

    pub(super) fn relax_slow(&mut self) {
        let mean = self.heating / TURNS as f64;
        for pole in &mut self.slow {
            pole.relax(mean);
        }
        self.heating = 0.0;
    }
}
