//! Bounds and means of drive and current.
//!
//! A heater's resistance is the ratio of the two means as long as it is the same throughout, whatever is driven in the
//! meantime. No drive heats without a mean, for a drive is never negative.

use control_core::design::{OUTPUT_FILTER_HZ, TICK};

/// Part of the way that a mean goes to a new value in a tick: the mean of some eight.
const MEAN_STEP: f32 = 1.0 / 8.0;

/// A mean that without its lag is less than this part of itself falls quickly.
const STEADY: f32 = 0.75;

/// An exponential moving average, and that of it.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    once: f32,
    twice: f32,
}

impl Mean {
    fn follow(&mut self, value: f32) {
        self.once += MEAN_STEP * (value - self.once);
        self.twice += MEAN_STEP * (self.once - self.twice);
    }

    /// The double exponential moving average: it does not lag behind what rises steadily, as a heater's resistance does.
    fn without_lag(self) -> f32 {
        2.0 * self.once - self.twice
    }
}

/// Part of the way that a pole of the output filter goes in a tick, if its corner is a tenth low:
/// 1 - exp(-2 pi 0.9 x 2 kHz x 0.1 ms).
const FILTER_STEP: f32 = 0.677;
const _: () = {
    // exp(-x) of x = 1.131 lies between its partial sums.
    let x = 2.0 * core::f32::consts::PI * 0.9 * OUTPUT_FILTER_HZ * TICK.0;
    let falls = 1.0 - x + x * x / 2.0 - x * x * x / 6.0;
    let x4 = x * x * x * x;
    let exp = falls + x4 / 24.0 - x4 * x / 120.0 + x4 * x * x / 720.0;
    assert!((1.0 - exp - FILTER_STEP).abs() < 2e-3);
};

/// Between what the voltage at the heater must be, whatever the corner of the output filter: it goes to a new drive at once,
/// or as slowly as the slowest filter.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Envelope {
    /// The bounds of the filter's two poles (V).
    lowest: [f32; 2],
    highest: [f32; 2],
    /// Those of the heater's voltage when the last tick began (V).
    before: (f32, f32),
}

impl Envelope {
    /// The bounds (V) while `drive` is applied, from the start of the tick to its end.
    pub(crate) fn follow(&mut self, drive: f32) -> (f32, f32) {
        let [low, high] = [self.lowest, self.highest];
        let slowly = |from: f32, to: f32| from + FILTER_STEP * (to - from);
        let first = (
            lower(drive, slowly(low[0], drive)),
            higher(drive, slowly(high[0], drive)),
        );
        let second = (
            lower(first.0, slowly(low[1], low[0])),
            higher(first.1, slowly(high[1], high[0])),
        );
        (self.lowest, self.highest) = ([first.0, second.0], [first.1, second.1]);
        let before = core::mem::replace(&mut self.before, second);
        (lower(before.0, second.0), higher(before.1, second.1))
    }
}

// `min` and `max` are calls on this processor.
pub(crate) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

pub(crate) fn higher(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Means of what was driven and sensed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Means {
    /// The output filter's poles (V).
    filter: [f32; 2],
    /// Mean of the drive (V), if the current follows at once, and if it lags by the slowest filter and is sampled at the
    /// start of a tick.
    at_once: Mean,
    filtered: Mean,
    /// Mean of the current (A).
    current: Mean,
}

impl Means {
    pub(crate) fn follow(&mut self, drive: f32, current: f32) {
        let [first, second] = self.filter;
        self.filter = [
            first + FILTER_STEP * (drive - first),
            second + FILTER_STEP * (first - second),
        ];
        self.at_once.follow(drive);
        self.filtered.follow(second);
        self.current.follow(current);
    }

    /// The means: the least that the voltage at the heater may be and the most (V), and the current (A).
    pub(crate) fn now(&self) -> (f32, f32, f32) {
        let (at_once, filtered) = (self.at_once.once, self.filtered.once);
        let (low, high) = (lower(at_once, filtered), higher(at_once, filtered));
        (low, high, self.current.once)
    }

    /// The same without the lag of a mean; nothing where the drive falls so quickly that it tells nothing.
    pub(crate) fn without_lag(&self) -> Option<(f32, f32, f32)> {
        let (at_once, filtered) = (self.at_once.without_lag(), self.filtered.without_lag());
        let (low, high) = (lower(at_once, filtered), higher(at_once, filtered));
        let falls = low < STEADY * lower(self.at_once.once, self.filtered.once);
        (!falls).then(|| (low, high, self.current.without_lag()))
    }
}
