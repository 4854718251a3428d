//! How far a mirror follows a signal that repeats: what heating that is neither below zero nor above what the highest drive makes
//! leaves of it behind the thermal poles, and the plate above its resonance.

use std::f64::consts::{PI, TAU};

use control_core::calibration::{ActuatorCalibration, FAST_POLES, Heat, Lag};
use control_core::{CHANNELS, Calibration, Kelvin, Micrometre, PlateInverse, Pose, TICK};
use nalgebra::Complex;

use crate::PlatePose;
use crate::dynamics::lowest_resonance_hz;

/// Steps of one period at most; those of a long one are longer than a tick. A choice: 0.02 degrees of a turn each.
const MOST_STEPS: f64 = 20_000.0;
/// Time constants after which a fast pole is taken for settled: e^-5 is 0.7 %.
const SETTLED: f64 = 5.0;

/// Where a mirror of this calibration comes to along `asked`, of the time (s), in the ticks of one `period_s`, once that has
/// repeated itself for a while: times (s) and poses. Hysteresis and creep are left out, and that a plate rings.
pub fn reached(
    calibration: &Calibration,
    asked: impl Fn(f64) -> PlatePose,
    period_s: f64,
) -> Vec<(f64, PlatePose)> {
    let parts = calibration.parts();
    let steps = (period_s / f64::from(TICK.0))
        .round()
        .clamp(1.0, MOST_STEPS);
    let step_s = period_s / steps;
    let plate = PlateInverse::new(&parts.plate, calibration.max_position());
    let asked_um: Vec<[f64; CHANNELS]> = (1..=steps as usize)
        .map(|step| {
            let pose = Pose::from(asked(step as f64 * step_s));
            plate.positions(&pose).0.map(f64::from)
        })
        .collect();
    let longest_s = parts.heat.fast.iter().map(|lag| f64::from(lag.time.0));
    let settled_s = SETTLED * longest_s.fold(0.0, f64::max);
    let cycles = (settled_s / period_s).ceil() as usize;
    let most_v = f64::from(parts.bounds.drive.0);
    let resonance_hz = lowest_resonance_hz(&parts.path);
    let mut actuators: [_; CHANNELS] = std::array::from_fn(|i| {
        let own: Vec<f64> = asked_um.iter().map(|um| um[i]).collect();
        let heated = HeatedActuator::along(&own, &calibration.actuators()[i], &parts.heat, step_s);
        (
            heated,
            Plate::at_rest(own[own.len() - 1], resonance_hz, step_s),
        )
    });
    let mut step = |um: &[f64; CHANNELS]| {
        let mut reached_um = [0.0; CHANNELS];
        for (i, (heated, plate)) in actuators.iter_mut().enumerate() {
            reached_um[i] = plate.step(heated.step(um[i], most_v)) as f32;
        }
        PlatePose::from(plate.pose(&reached_um))
    };
    for _ in 0..cycles {
        asked_um.iter().for_each(|um| {
            step(um);
        });
    }
    let times = (1..).map(|count: u32| f64::from(count) * step_s);
    times.zip(asked_um.iter().map(step)).collect()
}

/// One actuator on the way.
struct HeatedActuator<'a> {
    actuator: &'a ActuatorCalibration,
    weights: [f64; FAST_POLES],
    /// Part of the way that each fast pole goes in a step.
    rates: [f64; FAST_POLES],
    fast_k: [f64; FAST_POLES],
    /// By how many steps it is slower than the poles say.
    slower: f64,
    /// What is stored for each square kelvin by which the rise's square changes in a step (1/K).
    stored_per_k2: f64,
    /// What the slow poles bring, which is the same all along a period.
    slow_k: f64,
}

impl<'a> HeatedActuator<'a> {
    /// At rest in the middle of what is asked.
    fn along(asked: &[f64], actuator: &'a ActuatorCalibration, heat: &Heat, step_s: f64) -> Self {
        let rises = asked.iter().map(|&um| rise_k(actuator, um));
        let mean_k = rises.sum::<f64>() / asked.len() as f64;
        let weight = |lag: &Lag| f64::from(lag.weight);
        let weights = heat.fast.each_ref().map(weight);
        let rate = |lag: &Lag| match lag.time.0 > 0.0 {
            true => -(-step_s / f64::from(lag.time.0)).exp_m1(),
            false => 1.0,
        };
        Self {
            actuator,
            weights,
            rates: heat.fast.each_ref().map(rate),
            fast_k: weights.map(|weight| weight * mean_k),
            slower: f64::from(actuator.slower_by.0) / step_s,
            stored_per_k2: 0.5 * f64::from(heat.time_growth.0) / step_s,
            slow_k: mean_k * heat.slow.iter().map(weight).sum::<f64>(),
        }
    }

    /// Heats as the core does, so that it is at `asked_um` after the step if it can be; returns where it is (um).
    fn step(&mut self, asked_um: f64, most_v: f64) -> f64 {
        let gain: f64 = self
            .weights
            .iter()
            .zip(self.rates)
            .map(|(w, rate)| w * rate)
            .sum();
        let free: f64 = self
            .fast_k
            .iter()
            .zip(self.rates)
            .map(|(k, rate)| k * (1.0 - rate))
            .sum();
        let now_k = self.slow_k + self.fast_k.iter().sum::<f64>();
        let asked_k = rise_k(self.actuator, asked_um);
        let wanted_k = (asked_k - self.slow_k - free) / gain;
        let lost_k = f64::from(self.actuator.loss_growth.0) * now_k * now_k;
        let stored_per_k = self.slower + self.stored_per_k2 * (asked_k + now_k);
        let stored_k = stored_per_k * (asked_k - now_k);
        let power_k = wanted_k + lost_k + stored_k;
        let driven_k = power_k.clamp(0.0, self.most_k(now_k, most_v));
        // What is kept from it by a bound, less what is stored by as much less of a way.
        let slope = 1.0 + gain * stored_per_k;
        let heating_k = wanted_k + (driven_k - power_k) / slope;
        for ((k, weight), rate) in self.fast_k.iter_mut().zip(self.weights).zip(self.rates) {
            *k += rate * (weight * heating_k - *k);
        }
        let rise = Kelvin((self.slow_k + self.fast_k.iter().sum::<f64>()) as f32);
        f64::from(self.actuator.shape.position(rise).0)
    }

    /// What the power of the highest drive at a temperature rise would hold without any growth of the loss (K).
    fn most_k(&self, rise_k: f64, most_v: f64) -> f64 {
        let ohm = f64::from(self.actuator.resistance(Kelvin(rise_k as f32)).0);
        let resistance_k_w = f64::from(self.actuator.thermal_resistance.0);
        resistance_k_w * most_v * most_v / ohm
    }
}

/// The plate on its springs, under one of its actuators, as far as it follows: of the second order, and damped so that it is flat up to its resonance
/// (Butterworth). A real one rings there, which no calibration tells.
struct Plate {
    /// Half of the displacement, with its phase (um).
    half_um: Complex<f64>,
    /// What a step leaves of it, and what the input brings.
    pole: Complex<f64>,
    gain: Complex<f64>,
}

impl Plate {
    fn at_rest(um: f64, resonance_hz: f64, step_s: f64) -> Self {
        let omega = TAU * resonance_hz;
        // Its poles are this and the conjugate, of which partial fractions make the displacement twice the real part.
        let pole_per_s = Complex::from_polar(omega, 0.75 * PI);
        let part = Complex::from(omega * omega) / (pole_per_s - pole_per_s.conj()) / pole_per_s;
        let pole = (pole_per_s * step_s).exp();
        Self {
            half_um: -part * um,
            pole,
            gain: part * (pole - 1.0),
        }
    }

    /// A step in which it is pulled to `um`; returns where it is after it (um).
    fn step(&mut self, um: f64) -> f64 {
        self.half_um = self.pole * self.half_um + self.gain * um;
        2.0 * self.half_um.re
    }
}

fn rise_k(actuator: &ActuatorCalibration, um: f64) -> f64 {
    f64::from(actuator.shape.temperature_rise(Micrometre(um as f32)).0)
}

#[cfg(test)]
mod tests {
    use control_core::Second;
    use control_core::calibration::{Parts, Path, Resonance};
    use mirror_model::Model;

    use super::*;

    /// The reconciled mirror with one thermal pole of this time constant.
    fn with_pole(time_s: f32) -> Calibration {
        let model = Model::load("reconciled").expect("a preset");
        let tabulated = crate::tabulate(&model).expect("a calibration");
        let mut heat = Heat::INSTANT;
        heat.fast[0].time = Second(time_s);
        let parts = Parts {
            heat,
            path: Path {
                // A plate too fast to matter.
                move_time: Second(1e-3),
                resonance: Resonance::UNKNOWN,
            },
            ..*tabulated.calibration.parts()
        };
        Calibration::new(parts).expect("a calibration")
    }

    fn span_um(calibration: &Calibration, amplitude_um: f64, frequency_hz: f64) -> f64 {
        let sine = |t_s: f64| 80.0 + amplitude_um * (TAU * frequency_hz * t_s).sin();
        let level = |t_s: f64| PlatePose {
            z_um: sine(t_s),
            ..PlatePose::default()
        };
        let along = reached(calibration, level, 1.0 / frequency_hz);
        let z_um = || along.iter().map(|(_, pose)| pose.z_um);
        z_um().fold(f64::MIN, f64::max) - z_um().fold(f64::MAX, f64::min)
    }

    #[test]
    fn what_heating_can_follow_is_reached() {
        let calibration = with_pole(10e-3);
        for (amplitude_um, frequency_hz) in [(20.0, 0.1), (20.0, 5.0), (1.0, 100.0)] {
            let span_um = span_um(&calibration, amplitude_um, frequency_hz);
            // Samples of a period miss its turning points by less.
            assert!(
                (span_um / (2.0 * amplitude_um) - 1.0).abs() < 0.01,
                "{span_um} um at {frequency_hz} Hz"
            );
        }
    }

    #[test]
    fn a_slow_tilt_is_reached_beside_the_piston() {
        let parts = Parts {
            plate: control_core::calibration::Plate::cross(Micrometre(480.0)),
            ..*with_pole(10e-3).parts()
        };
        let calibration = Calibration::new(parts).expect("levers only");
        let asked = |t_s: f64| PlatePose {
            z_um: 80.0,
            tilt_x_rad: 0.02 * (TAU * 5.0 * t_s).sin(),
            tilt_y_rad: 0.01,
        };
        for (t_s, pose) in reached(&calibration, asked, 0.2) {
            let asked = asked(t_s);
            // The plate's own lag at 5 Hz below 500 Hz turns the sine by some 1.4 % of a radian.
            assert!(
                (pose.tilt_x_rad - asked.tilt_x_rad).abs() < 0.02 * 0.02,
                "{pose:?}"
            );
            assert!((pose.tilt_y_rad - 0.01).abs() < 1e-5, "{pose:?}");
            assert!((pose.z_um - 80.0).abs() < 1e-2, "{pose:?}");
        }
    }

    #[test]
    fn a_plate_follows_up_to_its_resonance_as_a_butterworth_filter_does() {
        let (resonance_hz, step_s) = (500.0, 1e-6);
        for frequency_hz in [5.0, 250.0, 500.0, 2000.0] {
            let mut plate = Plate::at_rest(80.0, resonance_hz, step_s);
            let mut at = |step: usize| {
                let t_s = step as f64 * step_s;
                plate.step(80.0 + (TAU * frequency_hz * t_s).sin())
            };
            // What it begins with has faded after ten periods of its own.
            let settled = (10.0 / resonance_hz / step_s) as usize;
            let _ = (0..settled).map(&mut at).last();
            let period = (1.0 / frequency_hz / step_s) as usize;
            let highest = (settled..settled + period).map(at).fold(0.0, f64::max) - 80.0;
            let expected = 1.0 / (1.0 + (frequency_hz / resonance_hz).powi(4)).sqrt();
            assert!(
                (highest - expected).abs() < 1e-3,
                "{highest} at {frequency_hz} Hz"
            );
        }
    }

    /// Heating that is on for a part d of a short period and off for the rest moves one pole by H d (1 - d) period / tau, and
    /// nothing moves it farther.
    #[test]
    fn what_is_too_fast_is_left_out_as_one_pole_leaves_it() {
        let (time_s, frequency_hz) = (10e-3, 1000.0);
        let calibration = with_pole(time_s as f32);
        let span_um = span_um(&calibration, 40.0, frequency_hz);
        let actuator = &calibration.actuators()[0];
        // At rest at 80 um the on time's part is the power there over that of the highest drive, by either's heating without growth.
        let (rise, most_v) = (rise_k(actuator, 80.0), f64::from(calibration.max_drive().0));
        let heated = HeatedActuator::along(&[80.0], actuator, &calibration.parts().heat, 1e-4);
        let most_k = heated.most_k(rise, most_v);
        let part = rise * (1.0 + f64::from(actuator.loss_growth.0) * rise) / most_k;
        let slope_um_k = 1.0 / (rise_k(actuator, 80.5) - rise_k(actuator, 79.5));
        let bound_um = slope_um_k * most_k * part * (1.0 - part) / (frequency_hz * time_s);
        // It is asked to be on for the half of each period, a little less than what moves it most, about a mean of its own.
        assert!(
            (0.5 * bound_um..1.1 * bound_um).contains(&span_um),
            "{span_um} of {bound_um} um"
        );
    }
}
