//! The watch over one heater: does its current fit its drive?

use control_core::design::{
    ADC_SATURATED, COLD_RESISTANCE_TOLERANCE, HIGHEST_CURRENT, HOTTEST_RISE,
};
use control_core::{ActuatorCalibration, AdcCode, Ampere, Kelvin, Volt};

use crate::fault::Fault;

/// A heater is too hot at this part more than the highest rise that its calibration allows. The core
/// holds positions below that one; a model of a mirror is off by some of this.
const RISE_MARGIN: f32 = 1.25;

/// The least plausible resistance, and the highest, as a part of the cold one.
const LEAST_RESISTANCE: f32 = 0.5;
const HIGHEST_RESISTANCE: f32 = 2.0;

/// A heater with more than this resistance, as a part of the cold one, is an open one.
const OPEN_RESISTANCE: f32 = 10.0;

/// Errors of the sense that are no fault: noise (1 uA), offset of amplifier and converter (4 uA, before
/// it is calibrated).
const CURRENT_MARGIN: Ampere = Ampere(20e-6);

/// What is seen in so many ticks on end is a fault; one tick may be a glitch.
const TICKS_TO_TRIP: u8 = 3;

/// Part of the way that the envelope of the drive goes to the drive in a tick. The filter behind
/// the PWM (two poles at 2 kHz) goes faster, so current that only lags behind the drive lies within
/// the envelope.
const ENVELOPE_STEP: f32 = 0.2;

/// The current must show a drive that changed by so much: 40 uA in the hottest heater.
const FROZEN_CHANGE: Volt = Volt(0.02);
/// The lag of the filter, and as much again.
const TICKS_TO_FREEZE: u8 = 8;

/// The watch over one heater.
#[derive(Clone, Debug)]
pub(crate) struct ChannelWatch {
    bounds: Bounds,
    /// Envelope of the drive (V).
    highest: f32,
    lowest: f32,
    suspect_ticks: u8,
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
}

/// The rise at which a heater is too hot, where its calibration allows `allowed`. Resistance that is not known to the
/// heater's own R0 reads as warmth; the ceiling holds whatever a calibration says.
fn too_hot(channel: &ActuatorCalibration, allowed: Kelvin) -> Kelvin {
    let unknown = COLD_RESISTANCE_TOLERANCE.0 / (channel.cold_resistance.0 * channel.tcr.0);
    let rise = RISE_MARGIN * allowed.0 + unknown;
    // So that NaN is the ceiling, too.
    Kelvin(if rise < HOTTEST_RISE.0 {
        rise
    } else {
        HOTTEST_RISE.0
    })
}

impl ChannelWatch {
    pub(crate) fn new(channel: &ActuatorCalibration, allowed: Kelvin) -> Self {
        let cold = 1.0 / channel.cold_resistance.0;
        let hot = channel.resistance(too_hot(channel, allowed)).0;
        Self {
            bounds: Bounds {
                least: (1.0 / hot).max(cold / HIGHEST_RESISTANCE),
                highest: cold / LEAST_RESISTANCE,
                cold,
            },
            highest: 0.0,
            lowest: 0.0,
            suspect_ticks: 0,
            frozen: Frozen::default(),
        }
    }

    /// One tick: `code` and `current` were sensed while `drive` was applied.
    pub(crate) fn check(&mut self, drive: Volt, code: AdcCode, current: Ampere) -> Option<Fault> {
        self.follow(drive.0);
        let excess = current.0 > self.highest * self.bounds.highest + CURRENT_MARGIN.0
            || current.0 > HIGHEST_CURRENT.0;
        let lack = current.0 < self.lowest * self.bounds.least - CURRENT_MARGIN.0;
        if excess || lack {
            self.suspect_ticks = self.suspect_ticks.saturating_add(1);
            if self.suspect_ticks >= TICKS_TO_TRIP {
                return Some(if excess {
                    too_much(code, current)
                } else {
                    self.too_little(current)
                });
            }
        } else {
            self.suspect_ticks = 0;
        }
        self.frozen.check(drive, code).then_some(Fault::FrozenSense)
    }

    /// Forgets what was suspected.
    pub(crate) fn clear(&mut self) {
        self.suspect_ticks = 0;
        self.frozen = Frozen::default();
    }

    fn follow(&mut self, drive: f32) {
        let towards = |from: f32| from + ENVELOPE_STEP * (drive - from);
        // `max` and `min` are calls on this processor.
        let (high, low) = (towards(self.highest), towards(self.lowest));
        self.highest = if drive > high { drive } else { high };
        self.lowest = if drive < low { drive } else { low };
    }

    #[cold]
    fn too_little(&self, current: Ampere) -> Fault {
        let below =
            |part: f32| current.0 < self.lowest * self.bounds.cold / part - CURRENT_MARGIN.0;
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
fn too_much(code: AdcCode, current: Ampere) -> Fault {
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
