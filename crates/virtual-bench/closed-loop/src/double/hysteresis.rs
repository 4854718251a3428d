//! The memory of the displacement, inverted.

use control_core::Volt;
use control_core::calibration::{LAGS, Memory, PLAYS};

use super::poles::{Pole, pole};

/// A play operator and a lag of an actuator have their turn in every sixteenth tick.
pub(super) const TURNS: usize = 16;

/// Hysteresis, a sum of Prandtl-Ishlinskii play operators, and creep, inverted.
pub(super) struct Hysteresis {
    /// Slope of the part that no play operator delays, inverted.
    slope: f64,
    radius: [f64; PLAYS],
    weight: [f64; PLAYS],
    held: [f64; PLAYS],
    /// Rate at which a play operator lets go, by each volt (1/turn).
    release_per_volt: f64,
    creep: [Pole; LAGS],
    /// Position and displacement at the last turn, and the tangent from there.
    turned: (f64, f64, f64),
}

impl Hysteresis {
    /// The inverse of play operators is one of play operators: it has one where the virgin curve of the memory bends, and there its slope inverted.
    pub(super) fn new(memory: &Memory, highest: Volt) -> Self {
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
            release_per_volt: if release_s > 0.0 {
                (1.0 - pole(release_s, TURNS)) / f64::from(highest.0)
            } else {
                0.0
            },
            creep: memory.creep.map(|lag| Pole::new(lag, TURNS)),
            turned: (0.0, 0.0, 1.0 / at_once),
        }
    }

    /// Along the tangent of the last turn.
    pub(super) fn displacement(&self, z: f64) -> f64 {
        let (position, displacement, slope) = self.turned;
        displacement + slope * (z - position)
    }

    /// The actuator's turn, at `z`, by a drive (V), with that of lag and play operator `k`.
    pub(super) fn turn(&mut self, k: usize, z: f64, drive: Volt) {
        let y = z - self.creep.iter().map(|pole| pole.at).sum::<f64>();
        self.creep[k].relax(y);
        self.held[k] += (y - self.held[k]) * self.release_per_volt * f64::from(drive.0);
        let (mut x, mut slope) = (self.slope * y, self.slope);
        for k in 0..PLAYS {
            let held = self.held[k].clamp(y - self.radius[k], y + self.radius[k]);
            if held != self.held[k] {
                slope += self.weight[k];
            }
            self.held[k] = held;
            x += self.weight[k] * held;
        }
        self.turned = (z, x, slope);
    }
}
