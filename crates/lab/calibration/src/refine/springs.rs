//! The plate on its springs, forward: what it adds to where its actuators hold it, `z + z' / (w Q) + z'' / w^2 = held`.
//!
//! Below its resonance it goes further than it is held, at a third of it by an eighth, and a little later. Without this the thermal poles
//! would be made to.

use std::f64::consts::{PI, TAU};

use control_core::calibration::Resonance;

use super::timeline::TimeStep;

/// A plate whose resonance is known.
#[derive(Clone, Copy, Debug)]
struct Springs {
    omega_per_s: f64,
    quality: f64,
}

/// Where the plate is (um), and how fast it goes (um/s).
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    um: f64,
    um_per_s: f64,
}

/// What the plate adds at the end of every time step (um), given where it is held then; nothing where its resonance is not known.
pub(super) fn added_um(
    resonance: &Resonance,
    steps: &[TimeStep],
    held_um: impl IntoIterator<Item = f64>,
) -> Vec<f64> {
    let springs = Springs {
        omega_per_s: TAU * f64::from(resonance.frequency.0),
        quality: f64::from(resonance.quality),
    };
    let (mut motion, mut before_um) = (Motion::default(), 0.0);
    let added = |(step, now_um): (&TimeStep, f64)| {
        if step.duration_s > 0.0 {
            motion = springs.after(motion, (before_um, now_um), step.duration_s);
        }
        before_um = now_um;
        motion.um - now_um
    };
    let steps = steps.iter().zip(held_um);
    match resonance.is_known() {
        true => steps.map(added).collect(),
        false => vec![0.0; steps.count()],
    }
}

impl Springs {
    /// After so long, while it is held along a straight line: that line, late by 1 / (w Q), and a damped oscillation about it. Of a row
    /// that comes later than half a period nobody knows how it was held in between, and a line's corner would ring: there it keeps to the line.
    fn after(&self, motion: Motion, (from_um, to_um): (f64, f64), duration_s: f64) -> Motion {
        let Self {
            omega_per_s,
            quality,
        } = *self;
        let slope = (to_um - from_um) / duration_s;
        let late_um = slope / (omega_per_s * quality);
        let off = Motion {
            um: motion.um - (from_um - late_um),
            um_per_s: motion.um_per_s - slope,
        };
        if omega_per_s * duration_s > PI {
            return Motion {
                um: to_um - late_um,
                um_per_s: slope,
            };
        }
        let decay_per_s = 0.5 * omega_per_s / quality;
        let ringing_per_s = (omega_per_s * omega_per_s - decay_per_s * decay_per_s)
            .max(0.0)
            .sqrt();
        let left = (-decay_per_s * duration_s).exp();
        let (sine, cosine) = (ringing_per_s * duration_s).sin_cos();
        // What is damped critically does not ring: sin(x) / x is 1 there.
        let sine_s = match ringing_per_s > 0.0 {
            true => sine / ringing_per_s,
            false => duration_s,
        };
        let swing = off.um_per_s + decay_per_s * off.um;
        Motion {
            um: to_um - late_um + left * (off.um * cosine + swing * sine_s),
            um_per_s: slope
                + left
                    * (off.um_per_s * cosine
                        - (decay_per_s * off.um_per_s + omega_per_s * omega_per_s * off.um)
                            * sine_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use control_core::Hertz;

    use super::*;

    const RESONANCE: Resonance = Resonance {
        frequency: Hertz(350.0),
        quality: 12.0,
    };

    fn steps(duration_s: f64, count: usize) -> Vec<TimeStep> {
        let step = TimeStep {
            duration_s,
            ..TimeStep::default()
        };
        vec![step; count]
    }

    /// Of a sine at 100 Hz the plate makes 1 / |1 - r^2 + i r / Q| of its amplitude, r the ratio of the frequencies.
    #[test]
    fn along_a_sine_it_goes_as_much_further_as_the_frequency_response_tells() {
        let steps = steps(1e-4, 4000);
        let held = |i: usize| (TAU * 100.0 * 1e-4 * (i + 1) as f64).sin();
        let held: Vec<f64> = (0..steps.len()).map(held).collect();
        let added = added_um(&RESONANCE, &steps, held.iter().copied());
        // After 0.3 s ringing has fallen to exp(-27).
        let (amplitude, ratio) = (
            held.iter()
                .zip(&added)
                .skip(3000)
                .fold(0.0_f64, |most, (held, added)| {
                    most.max((held + added).abs())
                }),
            100.0_f64 / 350.0,
        );
        let expected = (1.0 - ratio * ratio).hypot(ratio / 12.0).recip();
        // A hundred straight lines a period take (pi / 100)^2 / 3 of it away, and as much hides between two of them.
        assert!(
            (amplitude / expected - 1.0).abs() < 1e-3,
            "{amplitude} and {expected}"
        );
    }

    #[test]
    fn steps_of_any_length_lead_to_the_same_motion() {
        let ramp = |duration_s: f64, count: usize| {
            let um = (1..=count).map(|i| 10.0 * i as f64 / count as f64);
            added_um(&RESONANCE, &steps(duration_s, count), um)[count - 1]
        };
        assert!((ramp(1e-3, 1) - ramp(1e-5, 100)).abs() < 1e-9);
        assert!(ramp(1e-3, 1).abs() > 1.0);
    }

    #[test]
    fn rows_too_far_apart_to_tell_make_no_ringing() {
        let um = (1..=10).map(|i| f64::from(i * i));
        let added = added_um(&RESONANCE, &steps(4e-3, 10), um);
        let late = |i: usize| -(2.0 * i as f64 + 1.0) / (4e-3 * TAU * 350.0 * 12.0);
        assert!(
            (0..10).all(|i| (added[i] - late(i)).abs() < 1e-9),
            "{added:?}"
        );
    }

    #[test]
    fn what_is_damped_critically_comes_late_and_does_not_ring() {
        let critical = Resonance {
            quality: 0.5,
            ..RESONANCE
        };
        let added = added_um(&critical, &steps(1e-3, 100), vec![1.0; 100]);
        assert!(added.iter().all(|um| *um < 1e-12));
        assert!(added[0] < -0.1 && added[99].abs() < 1e-12);
    }

    #[test]
    fn a_plate_of_no_known_resonance_adds_nothing() {
        let added = added_um(&Resonance::UNKNOWN, &steps(1e-3, 3), [1.0, 2.0, 3.0]);
        assert_eq!(added, vec![0.0; 3]);
    }
}
