//! One actuator: from its displacement to the temperature rise, the power and the volts.

use control_core::calibration::{ActuatorCalibration, Parts, Path};
use control_core::resistance::MIN_SENSE_DRIVE;
use control_core::{Ampere, Volt};

use super::apart::Apart;
use super::poles::{Beam, Poles, pole};
use super::table::{position_um, resistance_ohm, rest_um, rise_k};
use crate::TICK_S;

/// A current that is none (A).
const NO_CURRENT_A: f32 = 1e-6;
/// A sensed resistance may be so far from the model's.
const PLAUSIBLE: f64 = 0.25;
/// Part of the way to a new reading that the correction goes.
const PACE: f64 = 0.25;
/// Time constant with which an actuator catches up that a bound has held back, in periods of the resonance, and as part of a move where
/// none is known.
const CATCHING_UP: (f64, f64) = (1.25, 0.25);

fn catch_up_s(path: &Path) -> f64 {
    let (periods, part) = CATCHING_UP;
    match path.resonance.is_known() {
        true => periods / f64::from(path.resonance.frequency.0),
        false => part * f64::from(path.move_time.0),
    }
}

/// One actuator.
pub(super) struct Actuator {
    calibration: ActuatorCalibration,
    poles: Poles,
    beam: Beam,
    /// Where the beam was to be at the end of the last tick (K).
    asked: f64,
    /// Half of what the time constants grow by with a kelvin, in ticks.
    half_time_growth: f64,
    /// By how many ticks it is slower than the poles say.
    slower_ticks: f64,
    drive_limit_v: f64,
    power_limit_w: f64,
    rise: f64,
    /// How far it is to stay short of what it is asked for (K), and what a tick leaves of that.
    shortfall: f64,
    pole: f64,
    expected_ohm: f64,
    correction: f64,
    /// The mirror under the core's drive instead, with the same resistance.
    twin: Twin,
}

/// Poles that a power drives.
#[derive(Clone, Debug)]
struct Twin {
    poles: Poles,
    beam: Beam,
    rise: f64,
}

impl Actuator {
    pub(super) fn new(calibration: ActuatorCalibration, parts: &Parts) -> Self {
        let (poles, beam) = (Poles::new(&parts.heat), Beam::new(&parts.heat));
        Self {
            calibration,
            slower_ticks: f64::from(calibration.slower_by.0) / TICK_S,
            half_time_growth: 0.5 * f64::from(parts.heat.time_growth.0) / TICK_S,
            drive_limit_v: f64::from(parts.bounds.drive.0),
            power_limit_w: f64::from(parts.bounds.power.0),
            rise: 0.0,
            shortfall: 0.0,
            pole: pole(catch_up_s(&parts.path), 1),
            expected_ohm: f64::from(calibration.cold_resistance.0),
            correction: 1.0,
            twin: Twin {
                poles: poles.clone(),
                beam: beam.clone(),
                rise: 0.0,
            },
            poles,
            beam,
            asked: 0.0,
        }
    }

    pub(super) fn sense(&mut self, applied: Volt, current: Ampere) {
        if applied.0 < MIN_SENSE_DRIVE.0 || current.0 <= NO_CURRENT_A {
            return;
        }
        let ohm = f64::from(applied.0) / f64::from(current.0);
        let ratio = ohm / self.expected_ohm;
        self.correction = if (ratio - 1.0).abs() < PLAUSIBLE {
            self.correction + PACE * (ratio - self.correction)
        } else {
            1.0
        };
    }

    /// A tick that is to end at the displacement `x_um`, beside the drive of the core.
    pub(super) fn heat_to(&mut self, x_um: f64, core_v: f64) -> Apart {
        let beam = rise_k(&self.calibration, x_um);
        // A heater cannot cool.
        let target = (beam + self.beam.lag_ticks * (beam - self.asked)).max(0.0);
        self.asked = beam;
        self.expected_ohm = resistance_ohm(&self.calibration, self.rise);
        let ohm = self.expected_ohm * self.correction;
        let r_t = f64::from(self.calibration.thermal_resistance.0);
        let growth = f64::from(self.calibration.loss_growth.0);
        let aim = target - self.shortfall;
        let mut heating = self.poles.inverse(aim);
        let stored = self.slower_ticks * (aim - self.rise)
            + self.half_time_growth * (aim * aim - self.rise * self.rise);
        let asked_w = (heating + stored + growth * aim * aim) / r_t;
        let most_w = self.power_limit_w.min(self.drive_limit_v.powi(2) / ohm);
        let power_w = asked_w.clamp(0.0, most_w);
        if power_w != asked_w {
            heating = power_w * r_t - growth * self.rise * self.rise;
            heating -= self.stored(heating);
        }
        let drive_v = (power_w * ohm).sqrt();
        self.rise = self.poles.tick(heating);
        self.shortfall = self.pole * (target - self.rise);

        // What the core's drive does differs by this power.
        let more_w = (core_v * core_v - drive_v * drive_v) / ohm;
        let twin = &mut self.twin;
        twin.rise = twin.poles.tick(heating + more_w * r_t);
        let (twin, own) = (twin.beam.follow(twin.rise), self.beam.follow(self.rise));
        let place = |rise| position_um(&self.calibration, rise);
        Apart {
            drive_um: (rest_um(&self.calibration, core_v) - rest_um(&self.calibration, drive_v))
                .abs(),
            mirror_um: (place(twin) - place(own)).abs(),
        }
    }

    /// What a growing heat capacity takes of a heating, by one step of the secant method.
    fn stored(&self, heating: f64) -> f64 {
        let from = self.rise;
        let (without, per_heating) = (self.poles.after(heating), self.poles.gain());
        let per_k = self.slower_ticks + self.half_time_growth * (without + from);
        per_k * (without - from) / (1.0 + per_heating * per_k)
    }

    /// Mean heating since the last turn.
    pub(super) fn heating(&self) -> f64 {
        self.poles.heating()
    }

    /// The twin takes what is shared as it is: of what two drives differ by, a quarter goes round there.
    pub(super) fn relax_slow(&mut self, shared: f64) {
        self.poles.relax_slow(shared);
        self.twin.poles.relax_slow(shared);
    }
}
