//! Jumps of a meter: where an ammeter changes its range, or a contact gives way, the currents before and after lie on two curves.

use crate::dataset::{Channel, Dataset, Observation};
use measurement::held::MEDIAN_OF_NORMAL;

/// Readings on each side that a straight line is laid through.
const SIDE: usize = 3;
/// How far two such lines are apart where they meet, in standard deviations of one reading: each is known to
/// sqrt(1/3 + 1.5^2/2) there.
const SPREAD: f64 = 1.7;
/// A jump is so many times as large as what is usual in the experiment, and as the noise makes it.
const JUMP: f64 = 8.0;
/// Fewer readings say nothing of what is usual.
const ENOUGH: usize = 12;
/// So many of an experiment's readings are at another drive than the one before: a file of held drives has its steps for jumps.
const SWEPT: f64 = 0.8;

/// Where the currents jump against what a model predicts, in sentences.
pub fn jumps(data: &Dataset, predicted: &[f64]) -> Vec<String> {
    let seen: Vec<(&Observation, f64)> = data
        .observations
        .iter()
        .zip(predicted.iter().copied())
        .collect();
    let mut sentences = Vec::new();
    for experiment in 0..data.experiments.len() {
        for actuator in 0..mirror_model::ACTUATORS {
            // Where nothing is driven no current is predicted, and what a meter reads there is its zero.
            let is_of_it = |(o, modelled): &&(&Observation, f64)| {
                o.experiment == experiment
                    && o.channel == Channel::Current(actuator)
                    && *modelled != 0.0
                    && o.value / modelled > 0.0
            };
            let readings: Vec<_> = seen.iter().filter(is_of_it).copied().collect();
            sentences.extend(jump(data, &readings, actuator));
        }
    }
    sentences
}

/// The largest jump of one actuator's current in one experiment, if there is any.
fn jump(data: &Dataset, readings: &[(&Observation, f64)], actuator: usize) -> Option<String> {
    let drives: Vec<f64> = readings
        .iter()
        .map(|(o, _)| data.drive(o)[actuator])
        .collect();
    let swept = drives.windows(2).filter(|pair| pair[0] != pair[1]).count();
    if readings.len() < ENOUGH || (swept as f64) < SWEPT * (readings.len() - 1) as f64 {
        return None;
    }
    let off: Vec<f64> = readings
        .iter()
        .map(|(o, modelled)| (o.value / modelled).ln())
        .collect();
    let apart: Vec<f64> = (SIDE..=off.len() - SIDE)
        .map(|at| {
            let before = [off[at - 1], off[at - 2], off[at - 3]];
            let after = [off[at], off[at + 1], off[at + 2]];
            on_the_line(after) - on_the_line(before)
        })
        .collect();
    let mut sizes: Vec<f64> = apart.iter().map(|a| a.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes[sizes.len() / 2] / MEDIAN_OF_NORMAL;
    let (index, size) = apart
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let (first, _) = readings[index + SIDE];
    // Of small currents the noise is the larger part, and of a meter's zero it is all.
    let around = readings[index..index + 2 * SIDE].iter();
    let noise = around.map(|(o, _)| o.noise / o.value.abs());
    let noise = SPREAD * noise.fold(0.0, f64::max);
    if size.abs() < JUMP * usual.max(noise) {
        return None;
    }
    let experiment = &data.experiments[first.experiment];
    let at = match data.is_steady {
        true => String::new(),
        false => format!(", {} s from its start", first.t_s),
    };
    Some(format!(
        "{experiment}: the current of actuator {} jumps by {:+.2} % at {:.3} V (reading {} of {}{at}): a meter's range, or a contact",
        actuator + 1,
        100.0 * size.exp_m1(),
        drives[index + SIDE],
        index + SIDE + 1,
        readings.len(),
    ))
}

/// The value, half a step before the first, of the straight line through three at equal steps, nearest first.
fn on_the_line([near, middle, far]: [f64; 3]) -> f64 {
    let mean = (near + middle + far) / 3.0;
    // From the middle one to there it is a step and a half.
    mean + 1.5 * (near - far) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sweep of a heater that warms, and what a model without that predicts; from a reading on the ammeter reads so much more.
    fn sweep(rows: usize, jump_at: usize, by: f64, noise: f64) -> (Dataset, Vec<f64>) {
        let volts = |row: usize| 0.2 * (row + 1) as f64;
        let mut data = Dataset::driven((0..rows).map(|row| (volts(row), 1.0)));
        let mut predicted = Vec::new();
        for row in 0..rows {
            let warm = volts(row) / (100.0 + 3.0 * volts(row).powi(2));
            // A scatter that repeats, of this size.
            let scatter = noise * [0.4, -1.2, 0.9, 1.1, -0.7, -0.5, 1.3][row % 7];
            let gain = if row >= jump_at { 1.0 + by } else { 1.0 };
            data = data.reading(
                row,
                Channel::Current(0),
                warm * gain * (1.0 + scatter),
                noise * warm,
            );
            predicted.push(volts(row) / 100.0);
        }
        (data, predicted)
    }

    #[test]
    fn a_meter_s_zero_is_no_jump() {
        let (mut data, mut predicted) = sweep(40, 40, 0.0, 1e-4);
        let first = data.observations[0].noise;
        for (value, modelled) in data.observations.iter_mut().zip(&mut predicted).take(1) {
            (value.value, value.noise) = (2e-6, 1e-6_f64.max(first));
            *modelled = 4e-7;
        }
        assert_eq!(jumps(&data, &predicted), [""; 0]);
    }

    #[test]
    fn a_range_change_is_told_with_its_place() {
        let (data, predicted) = sweep(40, 25, 0.008, 1e-4);
        let said = jumps(&data, &predicted);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].contains("at 5.200 V (reading 26 of 40"), "{said:?}");
        assert!(
            said[0].contains("jumps by +0.8") || said[0].contains("jumps by +0.7"),
            "{said:?}"
        );
    }

    #[test]
    fn what_a_meter_reads_without_a_drive_is_no_jump() {
        let (mut data, mut predicted) = sweep(40, 99, 0.0, 1e-5);
        data.observations[39].value = 3e-7;
        predicted[39] = 0.0;
        assert_eq!(jumps(&data, &predicted), [""; 0]);
    }

    #[test]
    fn a_curve_and_noise_have_no_jump() {
        for noise in [1e-5, 1e-3] {
            let (data, predicted) = sweep(40, 99, 0.0, noise);
            assert_eq!(jumps(&data, &predicted), [""; 0], "{noise}");
        }
        let (data, predicted) = sweep(40, 25, 0.0005, 1e-3);
        assert_eq!(jumps(&data, &predicted), [""; 0], "below the noise");
    }
}
