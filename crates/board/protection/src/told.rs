//! How warm a heater is at least after what it was told.
//!
//! What its power makes of it by the calibration is computed, and how much of that this heater really becomes is learnt while it is driven:
//! another mirror than the factory's may lose twice the heat.

use control_core::design::{FILM_TCR_PER_K, HIGHEST_DRIVE};
use control_core::{ActuatorCalibration, Kelvin, Ohm};

use crate::mean::{higher, lower};

/// Segments of the table.
const SEGMENTS: usize = 8;
const SEGMENTS_PER_V2: f32 = SEGMENTS as f32 / (HIGHEST_DRIVE.0 * HIGHEST_DRIVE.0);
/// Iterations of Newton's from one knot to the next, 12 to 30 K higher: each squares the part that is off.
const ITERATIONS: usize = 3;

/// Part of the rise at rest that a heater has at least: slow poles have a tenth of it, and its neighbours may be cold.
const LEAST_PART: f32 = 0.85;
/// How much colder it may read for other reasons, 10.6 K for an R0 that is off by 15 ohm, 10 K for a colder room, 4 K for 1.5 % of
/// the sense: in its check than at calibration, and afterwards than in its check.
const COLDER: Kelvin = Kelvin(25.0);
/// What that is of its resistance: R0 and xi are a line through what it has where the mirror is used, and nearer to rest its film's
/// own coefficient counts.
const LESS: f32 = COLDER.0 * FILM_TCR_PER_K;
/// Part of the calculated growth that is to be there while nothing is learnt yet: that of a mirror which loses twice the heat of the paper's.
/// A virtual one loses 1.45 times as much (family E, seed 845).
const LEAST_SHARE: f32 = 0.5;
/// Nothing is learnt from a heater whose resistance is to grow by less: 25 K, as much as it may read colder.
const LEAST_GROWTH: f32 = 0.1;
/// Nor from one that was heated by more within the last second, and may still be warm of it: its square's part of that one's.
const STEADY: f32 = 0.95;

/// Part of the way that the least square of the drive rises in a tick. In its second a heater comes to within the slow
/// poles of rest.
const RISE_STEP: f32 = 1e-4;
/// Ticks from one turn of a channel to learn to the next.
pub(crate) const TURNS: usize = 16;
/// The same part of the highest, which falls, from turn to turn.
const FALL_STEP: f32 = TURNS as f32 * RISE_STEP;

/// How warm a heater is at least after what it was told: it is no colder than the room, and has been heated.
///
/// To compute the table for four channels takes a third of a tick on the driver board, 36 us. So it grows by a knot in a turn,
/// and what is not known yet is that of a heater that has not been heated. It is whole after 13 ms: before the heaters' check of a start is
/// over, and long before a drive counts for what it has been for a second.
#[derive(Clone, Debug)]
pub(crate) struct Told {
    /// Part by which its resistance is to grow, by the square of the drive.
    growth: [f32; SEGMENTS + 1],
    /// How many of them are known, and the rise that the last one of them is for (K).
    known: usize,
    rise: f32,
    heater: Heater,
    /// Its resistance when cold: the calibration's, or the lower one that its checks have shown.
    cold: Ohm,
    /// Part of the calculated growth that it has shown so far.
    share: f32,
    /// The least resistance of one that was not heated, and what the calculated growth adds to it (ohm).
    least_ohm: f32,
    growing_ohm: f32,
    /// What the square of the drive has been at least, and at most, for a second (V^2).
    least: f32,
    most: f32,
}

/// A heater as its calibration describes it.
#[derive(Clone, Copy, Debug)]
struct Heater {
    /// Resistance at rest, in the room of the calibration.
    cold: Ohm,
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
        let heating = self.thermal_resistance * square / self.cold.0;
        let mut rise = guess;
        for _ in 0..ITERATIONS {
            let (ohmic, lost) = (1.0 + self.tcr * rise, 1.0 + self.growth * rise);
            let slope = ohmic * lost + rise * (self.tcr * lost + self.growth * ohmic);
            rise += (heating - rise * ohmic * lost) / slope;
        }
        rise
    }
}

impl Told {
    /// Of this heater; it learns when it has its turn.
    pub(crate) fn new(actuator: &ActuatorCalibration) -> Self {
        let heater = Heater {
            cold: actuator.resistance_at_rest(),
            tcr: actuator.tcr.0,
            growth: actuator.loss_growth.0,
            thermal_resistance: actuator.thermal_resistance.0,
        };
        let mut told = Self {
            growth: [0.0; SEGMENTS + 1],
            known: 1,
            rise: 0.0,
            cold: heater.cold,
            heater,
            share: LEAST_SHARE,
            least_ohm: 0.0,
            growing_ohm: 0.0,
            least: 0.0,
            most: 0.0,
        };
        told.count_from_cold();
        told
    }

    /// What it has at least, from what it has when cold and has shown.
    fn count_from_cold(&mut self) {
        self.least_ohm = self.cold.0 * (1.0 - LESS);
        self.growing_ohm = self.cold.0 * LEAST_PART * self.share;
    }

    /// The turn in which a knot of the table is computed, or, once it is whole, it is learnt from a drive (V), as low as it may have
    /// been, and the current (A) that it made.
    pub(crate) fn learn(&mut self, drive: f32, current: f32) {
        if let Some(knot) = self.growth.get_mut(self.known) {
            let square = self.known as f32 / SEGMENTS_PER_V2;
            self.rise = self.heater.rise(square, self.rise);
            *knot = self.heater.tcr * self.rise;
            self.known += 1;
            return;
        }
        let square = drive * drive;
        self.most = higher(square, self.most + FALL_STEP * (square - self.most));
        let growth = self.growth_at(square);
        if square < STEADY * self.most || growth < LEAST_GROWTH {
            return;
        }
        let grown = drive / (current * self.cold.0) - 1.0;
        // Not so for NaN.
        if grown > self.share * growth {
            self.share = lower(1.0, grown / growth);
            self.count_from_cold();
        }
    }

    /// Nothing is learnt of it any more.
    pub(crate) fn forget(&mut self) {
        self.share = LEAST_SHARE;
        self.count_from_cold();
    }

    /// The least resistance of a heater that has not been heated.
    pub(crate) fn least_cold(&self) -> Ohm {
        Ohm(self.heater.cold.0 * (1.0 - LESS))
    }

    /// A check has shown no lower resistance than this. A heater that has less than its calibration says, or stands in a colder
    /// room, has as much less where it is hot.
    pub(crate) fn checked(&mut self, lowest: Ohm) {
        self.cold = Ohm(lower(self.heater.cold.0, lowest.0));
        self.count_from_cold();
    }

    /// The least resistance after a tick with at least this mean drive (V).
    pub(crate) fn least_resistance(&mut self, drive: f32) -> Ohm {
        let square = drive * drive;
        let rising = self.least + RISE_STEP * (square - self.least);
        self.least = lower(square, rising);
        Ohm(self.least_ohm + self.growing_ohm * self.growth_at(self.least))
    }

    /// Part by which the resistance is to grow at this square of the drive (V^2).
    fn growth_at(&self, square: f32) -> f32 {
        let place = square * SEGMENTS_PER_V2;
        // The cast takes what is no number to 0.
        let segment = (place as usize).min(SEGMENTS - 1);
        let (low, high) = (self.growth[segment], self.growth[segment + 1]);
        low + (place - segment as f32) * (high - low)
    }
}
