//! The watch over one channel: does its current fit its drive?

use control_core::design::{
    ADC_SATURATED, COLD_RESISTANCE_TOLERANCE, HIGHEST_CURRENT, HIGHEST_TRIP_RISE, LEAST_TCR_PER_K,
    SENSE_OFFSET, SHUNT,
};
use control_core::{ActuatorCalibration, AdcCode, Ampere, Kelvin, Ohm, Volt};

use crate::fault::Fault;
use crate::mean::{Envelope, Means, higher, lower};
use crate::told::Told;

/// A heater is too hot at this part more than the highest rise that its calibration allows. The core
/// holds positions below that one; a model of a mirror is off by some of this.
const RISE_MARGIN: f32 = 1.25;

/// The least plausible resistance, and the highest, as a part of the cold one.
const LEAST_RESISTANCE: f32 = 0.5;
const HIGHEST_RESISTANCE: f32 = 2.0;

/// A heater with more than this resistance, as a part of the cold one, is an open one.
const OPEN_RESISTANCE: f32 = 10.0;

/// Errors of the sense that are no fault, 20 uA: offset of the amplifier, of which no part of such a board has five times the
/// usual one, and noise (1 uA).
const CURRENT_MARGIN: Ampere = Ampere(5.0 * SENSE_OFFSET.0 / SHUNT.0);
/// The same without the noise, which a mean leaves little of: 12 uA.
const MEAN_CURRENT_MARGIN: Ampere = Ampere(3.0 * SENSE_OFFSET.0 / SHUNT.0);

/// Less than this part of the least current is seen in two ticks, not three, where the drive is high: a quick heater, of
/// 0.6 ms, gets 10 K hotter in one.
const FAR: f32 = 0.96;
const HIGH_DRIVE: Volt = Volt(1.0);

/// A heater whose resistance falls by less than this part from one check to the next, a quarter of a second later, has
/// cooled: 0.5 K, against 0.1 K of noise. In vacuum, where it may take 10 s to cool, it is within 20 K of the room then.
const COOLED: f32 = 0.998;

/// The current must show a drive that changed by so much: 40 uA in the hottest heater.
const FROZEN_CHANGE: Volt = Volt(0.02);
/// The lag of the filter, and as much again.
const TICKS_TO_FREEZE: u8 = 8;

/// The watch over one channel.
#[derive(Clone, Debug)]
pub(crate) struct ChannelWatch {
    bounds: Bounds,
    /// The lowest resistance that a check of the heater has shown since the board started. However much a
    /// calibration claims, the heater has no more when it is cold.
    lowest: Ohm,
    /// What the last check has shown.
    last: Ohm,
    /// What the check senses.
    checked: Ampere,
    envelope: Envelope,
    means: Means,
    told: Told,
    /// Current that no heater makes, too much or below zero; too little, as of a hot one; too much for one that was heated.
    impossible: Suspicion,
    hot: Suspicion,
    cold: Suspicion,
    frozen: Frozen,
}

/// Conductances in siemens.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    /// Of a heater too hot.
    least: f32,
    /// Of a heater with too little resistance.
    highest: f32,
    cold: f32,
    /// Resistance at which the calibration has the heater too hot.
    hot_by_calibration: Ohm,
}

/// A count of what speaks for a fault, less what speaks against it. What does neither leaves it, so that nothing that
/// is driven in between resets it.
#[derive(Clone, Copy, Debug, Default)]
struct Suspicion(u8);

impl Suspicion {
    /// Two for each of three ticks on end; one tick may be a glitch.
    const TRIP: u8 = 6;

    fn confirm(&mut self, by: u8) -> bool {
        self.0 = self.0.saturating_add(by);
        self.0 >= Self::TRIP
    }

    fn contradict(&mut self) {
        self.0 = self.0.saturating_sub(1);
    }
}

impl Bounds {
    /// `actuator` may be `allowed` above ambient, and its resistance at ambient is at most `lowest`.
    fn new(actuator: &ActuatorCalibration, allowed: Kelvin, lowest: Ohm) -> Self {
        let cold = 1.0 / actuator.resistance_at_rest().0;
        // Resistance that is not known to the heater's own R0 reads as warmth.
        let unknown = COLD_RESISTANCE_TOLERANCE.0 * cold / actuator.tcr.0;
        let by_calibration = actuator.resistance(Kelvin(RISE_MARGIN * allowed.0 + unknown));
        let mut bounds = Self {
            least: 0.0,
            highest: cold / LEAST_RESISTANCE,
            cold,
            hot_by_calibration: by_calibration,
        };
        bounds.limit(lowest);
        bounds
    }

    /// The heater's resistance at ambient is at most `lowest`.
    fn limit(&mut self, lowest: Ohm) {
        let known_cold = self.cold.max(1.0 / lowest.0);
        let ceiling = known_cold / (1.0 + LEAST_TCR_PER_K * HIGHEST_TRIP_RISE.0);
        // `max` so that NaN is the ceiling, too.
        let least = ceiling.max(1.0 / self.hot_by_calibration.0);
        self.least = least.max(self.cold / HIGHEST_RESISTANCE);
    }
}

impl ChannelWatch {
    pub(crate) fn new(actuator: &ActuatorCalibration, allowed: Kelvin) -> Self {
        let unknown = Ohm(f32::INFINITY);
        Self {
            bounds: Bounds::new(actuator, allowed, unknown),
            lowest: unknown,
            last: unknown,
            checked: Ampere(0.0),
            envelope: Envelope::default(),
            means: Means::default(),
            told: Told::new(actuator),
            impossible: Suspicion::default(),
            hot: Suspicion::default(),
            cold: Suspicion::default(),
            frozen: Frozen::default(),
        }
    }

    /// Another calibration of the same heater, which stays as warm as it is.
    pub(crate) fn recalibrate(&mut self, actuator: &ActuatorCalibration, allowed: Kelvin) {
        self.bounds = Bounds::new(actuator, allowed, self.lowest);
        self.told = Told::new(actuator);
        self.told.checked(self.lowest);
    }

    /// Its turn to compute what its calibration makes of a drive, and to learn what it makes of one.
    pub(crate) fn learn(&mut self) {
        let (low, _, mean) = self.means.now();
        self.told.learn(low, mean);
    }

    /// One tick: `code` and `current` were sensed while `drive` was applied.
    pub(crate) fn check(&mut self, drive: Volt, code: AdcCode, current: Ampere) -> Option<Fault> {
        let (lowest, highest) = self.envelope.follow(drive.0);
        // A reading that no heater makes is counted here, and enters the means as the nearest that one can make: a conversion
        // that fails once would be in them for thirty ticks.
        let most = highest * self.bounds.highest + CURRENT_MARGIN.0;
        let possible = higher(0.0, lower(current.0, most));
        self.means.follow(drive.0, possible);
        let is_possible =
            current.0 >= -CURRENT_MARGIN.0 && current.0 <= lower(most, HIGHEST_CURRENT.0);
        if is_possible {
            self.impossible.contradict();
        } else if self.impossible.confirm(2) {
            return Some(impossible(code, current));
        }
        let hot = self.check_resistance(lowest, highest, Ampere(possible));
        if let Some(fault) = hot.or_else(|| self.check_told()) {
            return Some(fault);
        }
        self.frozen.check(drive, code).then_some(Fault::FrozenSense)
    }

    /// Is there too little current for the least voltage, in a tick or in the mean? What is driven at every tick leaves the
    /// means steady; what one tick shows has the more exact name. A tick with more current than a heater too hot can have at
    /// the highest voltage speaks against it, whatever is still in the means.
    fn check_resistance(&mut self, lowest: f32, highest: f32, current: Ampere) -> Option<Fault> {
        let least = self.bounds.least;
        if current.0 > highest * least + CURRENT_MARGIN.0 {
            self.hot.contradict();
            return None;
        }
        if current.0 < lowest * least - CURRENT_MARGIN.0 {
            let is_urgent = lowest > HIGH_DRIVE.0 && current.0 < FAR * lowest * least;
            let trips = self.hot.confirm(if is_urgent { 3 } else { 2 });
            return trips.then(|| self.too_little(lowest, current));
        }
        let (low, high, mean) = self.means.without_lag()?;
        if mean < low * least - MEAN_CURRENT_MARGIN.0 {
            let trips = self.hot.confirm(3);
            return trips.then(|| self.too_little(low, Ampere(mean)));
        }
        if mean > high * least + MEAN_CURRENT_MARGIN.0 {
            self.hot.contradict();
        }
        None
    }

    /// Is there more current than a heater can take after what it was told?
    fn check_told(&mut self) -> Option<Fault> {
        let (low, high, mean) = self.means.now();
        let least = self.told.least_resistance(low);
        if (mean - CURRENT_MARGIN.0) * least.0 <= high {
            self.cold.contradict();
            return None;
        }
        let trips = self.cold.confirm(1);
        trips.then_some(Fault::ImplausibleSense)
    }

    /// Begins the mean of the heater's check.
    pub(crate) fn begin_check(&mut self) {
        self.checked = Ampere(0.0);
    }

    /// A tick of the heater's check, that is `part` of its mean.
    pub(crate) fn add_to_check(&mut self, current: Ampere, part: f32) {
        self.checked.0 += part * current.0;
    }

    /// The end of the heater's check at `drive`: its resistance, cold or nearly so, and whether it still cools. What a
    /// heater shows that is no sound one is not kept: it would outlive the fault.
    #[cold]
    pub(crate) fn end_check(&mut self, drive: Volt) -> Result<bool, Fault> {
        let ohm = drive.0 / self.checked.0;
        let lowest = lower(ohm, self.lowest.0);
        if lowest < self.told.least_cold().0 {
            return Err(Fault::ImplausibleSense);
        }
        let is_cooling = ohm < COOLED * self.last.0;
        (self.last, self.lowest) = (Ohm(ohm), Ohm(lowest));
        self.bounds.limit(self.lowest);
        self.told.checked(self.lowest);
        if ohm * self.bounds.least > 1.0 {
            return Err(Fault::OverTemperature);
        }
        Ok(is_cooling)
    }

    /// Forgets what was suspected; what is known of the heater stays.
    pub(crate) fn clear(&mut self) {
        self.last = Ohm(f32::INFINITY);
        self.means = Means::default();
        self.told.forget();
        self.impossible = Suspicion::default();
        self.hot = Suspicion::default();
        self.cold = Suspicion::default();
        self.frozen = Frozen::default();
    }

    #[cold]
    fn too_little(&self, least_drive: f32, current: Ampere) -> Fault {
        let below =
            |part: f32| current.0 < least_drive * self.bounds.cold / part - CURRENT_MARGIN.0;
        if below(OPEN_RESISTANCE) || current.0 < CURRENT_MARGIN.0 {
            Fault::OpenHeater
        } else if below(HIGHEST_RESISTANCE) {
            Fault::ImplausibleSense
        } else {
            Fault::OverTemperature
        }
    }
}

#[cold]
fn impossible(code: AdcCode, current: Ampere) -> Fault {
    if code.0 >= ADC_SATURATED {
        Fault::ShortCircuit
    } else if current.0 > HIGHEST_CURRENT.0 {
        Fault::OverCurrent
    } else {
        Fault::ImplausibleSense
    }
}

/// A code that stays the same while the drive does not. A sound sense repeats a 16-bit code now and
/// then by chance, but not while the current changes.
#[derive(Clone, Copy, Debug, Default)]
struct Frozen {
    code: AdcCode,
    drive: Volt,
    ticks: u8,
}

impl Frozen {
    fn check(&mut self, drive: Volt, code: AdcCode) -> bool {
        if code != self.code {
            *self = Self {
                code,
                drive,
                ticks: 0,
            };
        } else if (drive.0 - self.drive.0).abs() > FROZEN_CHANGE.0 {
            self.ticks = self.ticks.saturating_add(1);
        }
        self.ticks >= TICKS_TO_FREEZE
    }
}
