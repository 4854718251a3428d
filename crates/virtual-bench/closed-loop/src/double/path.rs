//! The way from one position to another.

use crate::TICK_S;

/// The minimum-jerk trajectory (T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688): a polynomial of fifth order from where the mirror is to a target, at rest there.
pub(super) struct Path {
    ticks: f64,
    target: f64,
    /// Ticks since the move began.
    passed: f64,
    /// Distance from the target, in powers of the part of the move that is done.
    course: [f64; 6],
    now: f64,
}

impl Path {
    pub(super) fn new(move_s: f64) -> Self {
        Self {
            ticks: (move_s / TICK_S).max(1.0),
            target: 0.0,
            passed: f64::INFINITY,
            course: [0.0; 6],
            now: 0.0,
        }
    }

    pub(super) fn follow(&mut self, z: f64) -> f64 {
        (self.now, self.target, self.passed) = (z, z, f64::INFINITY);
        z
    }

    pub(super) fn toward(&mut self, target: f64) -> f64 {
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
