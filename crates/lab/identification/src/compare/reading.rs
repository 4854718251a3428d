//! What a model is off by, row by row, and what of it is worth a word.

use crate::Unit;
use mirror_model::ACTUATORS;

/// Trends that are smaller than this share of the largest error are none: of what a model is off by a person wants the main
/// part, not each quarter of it.
const ALIKE: f64 = 0.25;
/// Trends that are smaller than so many standard deviations of the noise are none: the usual three, which one reading of
/// normal noise in 370 exceeds.
pub(super) const SURE: f64 = 3.0;
/// An actuator is driven alone where the others have less than this part of its drive: a sixteenth of its heat.
const IDLE: f64 = 0.25;

/// One row of an experiment: its displacement, or the mean of its currents.
pub(super) struct Reading {
    pub(super) interval: usize,
    pub(super) t_s: f64,
    pub(super) drive: [f64; ACTUATORS],
    pub(super) measured: f64,
    pub(super) modelled: f64,
    pub(super) noise: f64,
}

impl Reading {
    pub(super) fn error(&self) -> f64 {
        self.measured - self.modelled
    }
}

pub(super) fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| {
        (sum + value * value, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

pub(super) fn highest(drives: [f64; ACTUATORS]) -> f64 {
    drives.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// The actuator that is driven alone, if one is.
pub(super) fn alone(drive: [f64; ACTUATORS]) -> Option<usize> {
    let top = highest(drive);
    let mut driven = (0..ACTUATORS).filter(|&i| drive[i] > IDLE * top);
    let first = driven.next().filter(|_| top > 0.0)?;
    driven.next().is_none().then_some(first)
}

/// The largest error, and the smallest that is worth a word.
pub(super) fn scale(readings: &[Reading]) -> (f64, f64) {
    let largest = readings.iter().map(|r| r.error().abs()).fold(0.0, f64::max);
    let noise = readings.iter().map(|r| r.noise).fold(0.0, f64::max);
    (largest, (ALIKE * largest).max(SURE * noise))
}

/// "too low by 9.2 um": which way a model is off where measured less modelled is `error`.
pub(super) fn off(error: f64, unit: Unit) -> String {
    let side = if error > 0.0 { "low" } else { "high" };
    format!("too {side} by {:.2} {unit}", error.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(error: f64, noise: f64) -> Reading {
        Reading {
            interval: 0,
            t_s: 0.0,
            drive: [0.0, 0.5, 2.0, 1.0],
            measured: 10.0 + error,
            modelled: 10.0,
            noise,
        }
    }

    #[test]
    fn a_root_mean_square_is_that_of_the_textbook_and_none_of_nothing() {
        assert_eq!(rms([3.0, -4.0].into_iter()), 12.5_f64.sqrt());
        assert_eq!(rms(std::iter::empty()), 0.0);
    }

    #[test]
    fn a_quarter_of_the_largest_error_is_worth_a_word_and_noise_is_not() {
        let quiet = [reading(-8.0, 0.01), reading(2.0, 0.02)];
        assert_eq!(scale(&quiet), (8.0, 2.0));
        let noisy = [reading(-0.5, 0.5), reading(1.0, 1.0)];
        assert_eq!(scale(&noisy), (1.0, 3.0));
        assert_eq!(scale(&[]), (0.0, 0.0));
    }

    #[test]
    fn a_model_below_what_was_measured_is_too_low() {
        assert_eq!(off(9.2, Unit::Micrometre), "too low by 9.20 um");
        assert_eq!(off(-0.035, Unit::Milliampere), "too high by 0.04 mA");
    }

    #[test]
    fn an_actuator_is_alone_beside_a_sense_bias_and_not_beside_a_drive() {
        assert_eq!(alone([0.2, 0.2, 3.5, 0.2]), Some(2));
        assert_eq!(alone([0.0, 1.0, 3.5, 0.0]), None);
        assert_eq!(alone([0.0; ACTUATORS]), None);
    }

    #[test]
    fn the_highest_drive_counts() {
        assert_eq!(highest(reading(0.0, 0.0).drive), 2.0);
    }
}
