//! A sine of positions, and the loop that a mirror makes of it.

use std::f64::consts::TAU;

use crate::TICK_S;

/// Periods until one is measured.
const PERIODS: usize = 3;

/// A sine of positions that begins at its lower end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sine {
    pub(crate) low_um: f64,
    high_um: f64,
    /// Ticks of a period.
    period: usize,
}

impl Sine {
    pub(crate) fn new((low_um, high_um): (f64, f64), hz: f64) -> Self {
        Self {
            low_um,
            high_um,
            period: (1.0 / (hz * TICK_S)).round() as usize,
        }
    }

    /// A part of it, from its upper end down.
    pub(crate) fn upper(self, share: f64) -> Self {
        Self {
            low_um: self.high_um - share * (self.high_um - self.low_um),
            ..self
        }
    }

    /// How far from it the mirror is in its third period (um), from the upper end's tick before it to its own: `tick`
    /// tells where the mirror is at the end of a tick (um) in which the position so many ticks ahead is asked for (um).
    pub(crate) fn errors_um(&self, ahead: f64, mut tick: impl FnMut(f64) -> f64) -> Vec<f64> {
        let (middle, half) = (
            0.5 * (self.low_um + self.high_um),
            0.5 * (self.high_um - self.low_um),
        );
        let place = |at: f64| middle - half * (TAU * at / self.period as f64).cos();
        (1..=PERIODS * self.period)
            .map(|at| tick(place(at as f64 + ahead)) - place(at as f64))
            .skip((PERIODS - 1) * self.period - 1)
            .collect()
    }

    /// The largest difference between the two ways through one position, from these errors (um).
    pub(crate) fn width_um(&self, errors_um: &[f64]) -> f64 {
        // The k-th tick of a period and the k-th before its end are at one position.
        let apart = (1..self.period / 2).map(|k| (errors_um[k] - errors_um[self.period - k]).abs());
        apart.fold(0.0, f64::max)
    }
}
