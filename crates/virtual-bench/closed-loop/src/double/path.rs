//! The way from one position to another.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

use control_core::calibration::{self, Resonance};
use nalgebra::{Complex, Matrix3, Vector3};

use crate::TICK_S;

/// The minimum-jerk trajectory (T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688): a polynomial of fifth order from where the mirror is to a
/// target, at rest there. What is asked for takes a plate on springs along it: z + z' / (w Q) + z'' / w^2.
pub(super) struct Path {
    ticks: f64,
    target: f64,
    /// Ticks since the move began.
    passed: f64,
    /// Distance from the target, in powers of the part of the move that is done.
    course: [f64; 6],
    /// Where the plate is, and what is asked for.
    place: f64,
    asked: f64,
    /// 1 / (w Q) and 1 / w^2, in moves.
    lead: [f64; 2],
    shaper: Option<Shaper>,
}

impl Path {
    pub(super) fn new(path: &calibration::Path) -> Self {
        let ticks = (f64::from(path.move_time.0) / TICK_S).max(1.0);
        let Resonance { frequency, quality } = path.resonance;
        let (omega, quality) = (TAU * f64::from(frequency.0), f64::from(quality));
        let per_radian = 1.0 / (omega * ticks * TICK_S);
        let is_known = path.resonance.is_known();
        Self {
            ticks,
            target: 0.0,
            passed: f64::INFINITY,
            course: [0.0; 6],
            place: 0.0,
            asked: 0.0,
            lead: match is_known {
                true => [per_radian / quality, per_radian * per_radian],
                false => [0.0; 2],
            },
            shaper: (is_known && quality > 0.5).then(|| Shaper::new(omega, quality)),
        }
    }

    pub(super) fn follow(&mut self, z: f64) -> f64 {
        let before = self.asked;
        let z = match &mut self.shaper {
            Some(shaper) => shaper.shape(before, z),
            None => z,
        };
        (self.place, self.asked, self.target, self.passed) = (z, z, z, f64::INFINITY);
        z
    }

    pub(super) fn toward(&mut self, target: f64) -> f64 {
        if target != self.target {
            self.course = self.bent_to(target);
            (self.target, self.passed) = (target, 0.0);
            if let Some(shaper) = &mut self.shaper {
                shaper.past.clear();
            }
        }
        self.passed += 1.0;
        self.place = self.target + self.moving(0);
        self.asked = self.place + self.lead[0] * self.moving(1) + self.lead[1] * self.moving(2);
        self.asked
    }

    /// A derivative of the distance from the target by the part of the move that is done.
    fn moving(&self, order: usize) -> f64 {
        let done = self.passed / self.ticks;
        // A move that has lasted whole ticks but for rounding is over.
        if done < 1.0 - 1e-9 {
            derivative(&self.course, order, done)
        } else {
            0.0
        }
    }

    /// From the present position, speed and acceleration to `target`, with neither speed nor acceleration there.
    fn bent_to(&self, target: f64) -> [f64; 6] {
        let (p, v, a) = (self.place - target, self.moving(1), self.moving(2));
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

/// A zero-vibration shaper: the way now, and the way half a damped period ago, by the two ticks about it. Weights are those for which what an
/// impulse of the way leaves ringing is zero.
struct Shaper {
    /// Of the way now, and so many ticks ago.
    weights: [(usize, f64); 3],
    /// The latest first.
    past: VecDeque<f64>,
}

impl Shaper {
    fn new(omega: f64, quality: f64) -> Self {
        let pole =
            Complex::new(0.5 / quality, (1.0 - 0.25 / (quality * quality)).sqrt()) * omega * TICK_S;
        let ago = (PI / pole.im).floor();
        let ringing = [0.0, ago, ago + 1.0].map(|ticks| (pole * ticks).exp());
        let matrix = Matrix3::new(
            1.0,
            1.0,
            1.0,
            ringing[0].re,
            ringing[1].re,
            ringing[2].re,
            ringing[0].im,
            ringing[1].im,
            ringing[2].im,
        );
        let weights = matrix
            .lu()
            .solve(&Vector3::new(1.0, 0.0, 0.0))
            .expect("two ticks are apart");
        let ago = ago as usize;
        Self {
            weights: [(0, weights[0]), (ago, weights[1]), (ago + 1, weights[2])],
            past: VecDeque::new(),
        }
    }

    fn shape(&mut self, before: f64, next: f64) -> f64 {
        let (oldest, _) = self.weights[2];
        if self.past.is_empty() {
            self.past.resize(oldest + 1, before);
        }
        self.past.push_front(next);
        self.past.truncate(oldest + 1);
        self.weights
            .iter()
            .map(|(ago, weight)| weight * self.past[*ago])
            .sum()
    }
}
