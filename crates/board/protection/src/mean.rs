//! Bounds and means of drive and current, and what the power told by the drive makes of a heater at least.
//!
//! A heater's resistance is the ratio of the two means as long as it is the same throughout, whatever is driven in the
//! meantime. No drive heats without a mean, for a drive is never negative.

use control_core::design::{HIGHEST_DRIVE, OUTPUT_FILTER_HZ, TICK};
use control_core::{ActuatorCalibration, Kelvin};

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

/// Segments of the table.
const SEGMENTS: usize = 8;
const SEGMENTS_PER_V2: f32 = SEGMENTS as f32 / (HIGHEST_DRIVE.0 * HIGHEST_DRIVE.0);
/// Iterations of Newton's from one knot to the next, 12 to 30 K higher: each squares the part that is off.
const ITERATIONS: usize = 3;

/// Part of the rise at rest that a heater has at least: slow poles have a tenth of it, and its neighbours may be cold.
const LEAST_PART: f32 = 0.85;
/// How much colder it may read for other reasons: 10.6 K for an R0 that is off by 15 ohm, 10 K for a colder room, 4 K
/// for 1.5 % of the sense.
const COLDER: Kelvin = Kelvin(25.0);
/// Part of the way that the least square of the drive rises in a tick. In its second a heater comes to within the slow
/// poles of rest.
const RISE_STEP: f32 = 1e-4;

/// The most conductance that a heater can have after what it was told: it is no colder than the room, and has been heated.
///
/// To compute all of it for four channels takes a third of a tick on the driver board, 36 us. So it grows by a knot in two ticks,
/// and what is not known yet is that of a heater that has not been heated: no heater conducts more. It is whole before the
/// heaters' check is over.
#[derive(Clone, Debug)]
pub(crate) struct Told {
    /// In siemens, by the square of the drive.
    knots: [f32; SEGMENTS + 1],
    /// How many of them are known, and the rise that the last one of them is for (K).
    known: usize,
    rise: f32,
    heater: Heater,
    /// What the square of the drive has been at least, for a second (V^2).
    square: f32,
}

/// A heater as its calibration describes it.
#[derive(Clone, Copy, Debug)]
struct Heater {
    /// Conductance at ambient (S).
    cold: f32,
    /// Temperature coefficient of the resistance, and the growth of the loss (1/K).
    tcr: f32,
    growth: f32,
    /// Thermal resistance (K/W).
    thermal_resistance: f32,
}

impl Heater {
    /// The rise (K) at which as much is lost as is heated by this square of the drive (V^2), from a guess below it.
    fn rise(&self, square: f32, guess: f32) -> f32 {
        // R_T V^2 / R0 = dT (1 + xi dT) (1 + g dT): eq. 3 with the loss's growth.
        let heating = self.thermal_resistance * self.cold * square;
        let mut rise = guess;
        for _ in 0..ITERATIONS {
            let (ohmic, lost) = (1.0 + self.tcr * rise, 1.0 + self.growth * rise);
            let slope = ohmic * lost + rise * (self.tcr * lost + self.growth * ohmic);
            rise += (heating - rise * ohmic * lost) / slope;
        }
        rise
    }

    /// The most conductance (S) at this rise (K).
    fn conductance(&self, rise: f32) -> f32 {
        self.cold / (1.0 + self.tcr * (LEAST_PART * rise - COLDER.0))
    }
}

impl Told {
    /// Of this heater; it learns at every tick.
    pub(crate) fn new(actuator: &ActuatorCalibration) -> Self {
        let heater = Heater {
            cold: 1.0 / actuator.cold_resistance.0,
            tcr: actuator.tcr.0,
            growth: actuator.loss_growth.0,
            thermal_resistance: actuator.thermal_resistance.0,
        };
        Self {
            knots: [heater.conductance(0.0); SEGMENTS + 1],
            known: 1,
            rise: 0.0,
            heater,
            square: 0.0,
        }
    }

    /// One more knot, where there is any left.
    pub(crate) fn learn(&mut self) {
        let square = self.known as f32 / SEGMENTS_PER_V2;
        if let Some(knot) = self.knots.get_mut(self.known) {
            self.rise = self.heater.rise(square, self.rise);
            *knot = self.heater.conductance(self.rise);
            self.known += 1;
        }
    }

    /// The most conductance (S) of a heater that has not been heated.
    pub(crate) fn of_a_cold_heater(&self) -> f32 {
        self.knots[0]
    }

    /// The most conductance (S) after a tick with at least this mean drive (V).
    pub(crate) fn highest_conductance(&mut self, drive: f32) -> f32 {
        let square = drive * drive;
        let rising = self.square + RISE_STEP * (square - self.square);
        self.square = if square < rising { square } else { rising };
        let place = self.square * SEGMENTS_PER_V2;
        // The cast takes what is no number to 0.
        let segment = (place as usize).min(SEGMENTS - 1);
        let (low, high) = (self.knots[segment], self.knots[segment + 1]);
        low + (place - segment as f32) * (high - low)
    }
}
