//! Whether one actuator, driven alone, moves the plate otherwise than the others say.

use super::reading::{Reading, alone};
use mirror_model::ACTUATORS;

/// A displacement that differs from what the others say by less is told by no word: models that follow all four actuators together
/// leave as much of one of them.
const UNLIKE: f64 = 0.05;
/// It is to differ by so many standard deviations of what its readings scatter otherwise than the others'.
const SURE: f64 = 5.0;
/// And by so many times what the others differ by among themselves: one that is unlike, and three that agree.
const STANDS_OUT: f64 = 3.0;
/// Readings that give a slope and an offset, and a scatter about them.
const READINGS: usize = 3;

/// How many times a displacement is the modelled one.
struct Line {
    slope: f64,
    /// What the scatter is divided by for the slope's standard deviation (um).
    spread_um: f64,
    /// The scatter about the line (um).
    left_um: f64,
}

/// One sentence on the first experiment in which one actuator is unlike the others.
pub(super) fn sentence(experiments: &[String], readings: &[Vec<Reading>]) -> Option<String> {
    let mut named = experiments.iter().zip(readings);
    named.find_map(|(name, readings)| {
        let (actuator, times) = unlike(readings)?;
        let side = if times < 1.0 { "less" } else { "more" };
        Some(format!(
            "{name}: actuator {} moves {:.0} % {side} than the others say",
            actuator + 1,
            100.0 * (times - 1.0).abs()
        ))
    })
}

/// The actuator that moves otherwise than the others, and how many times as much as they say.
fn unlike(readings: &[Reading]) -> Option<(usize, f64)> {
    let lines: Vec<Line> = (0..ACTUATORS)
        .map(|actuator| {
            let own = readings.iter().filter(|r| alone(r.drive) == Some(actuator));
            line(&own.collect::<Vec<_>>())
        })
        .collect::<Option<_>>()?;
    let others = |actuator: usize| (0..ACTUATORS).filter(move |other| *other != actuator);
    let mean = |actuator: usize| {
        let sum: f64 = others(actuator).map(|other| lines[other].slope).sum();
        sum / (ACTUATORS - 1) as f64
    };
    let times = |actuator: usize| lines[actuator].slope / mean(actuator);
    let off = |actuator: usize| (times(actuator) - 1.0).abs();
    let worst = (0..ACTUATORS).max_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    let most_of_others = |of: &dyn Fn(&Line) -> f64| {
        let of_others = others(worst).map(|other| of(&lines[other]));
        of_others.fold(0.0, f64::max)
    };
    let apart = most_of_others(&|line| (line.slope / mean(worst) - 1.0).abs());
    // A curve that the model lacks leaves as much of all four; a wild reading leaves more of one.
    let own_um = lines[worst].left_um - most_of_others(&|line| line.left_um);
    let noise_um = readings.iter().map(|r| r.noise).fold(0.0, f64::max);
    let scatter_um = own_um.abs().max(noise_um);
    let sure = SURE * scatter_um / (lines[worst].spread_um * mean(worst));
    let enough = UNLIKE.max(sure).max(STANDS_OUT * apart);
    (mean(worst) > 0.0 && off(worst) > enough).then(|| (worst, times(worst)))
}

/// The line through what was measured over what was modelled. Its offset takes what a plate that
/// rests elsewhere, or a sensor that drifts from one actuator to the next, would add.
fn line(readings: &[&Reading]) -> Option<Line> {
    if readings.len() < READINGS {
        return None;
    }
    let count = readings.len() as f64;
    let mean = |of: fn(&Reading) -> f64| readings.iter().map(|r| of(r)).sum::<f64>() / count;
    let (modelled, measured) = (mean(|r| r.modelled), mean(|r| r.measured));
    let product = |r: &&Reading| (r.modelled - modelled) * (r.measured - measured);
    let spread: f64 = readings
        .iter()
        .map(|r| (r.modelled - modelled).powi(2))
        .sum();
    let slope = readings.iter().map(product).sum::<f64>() / spread;
    let left = |r: &&Reading| (r.measured - measured - slope * (r.modelled - modelled)).powi(2);
    (spread > 0.0).then(|| Line {
        slope,
        spread_um: spread.sqrt(),
        left_um: (readings.iter().map(left).sum::<f64>() / (count - 2.0)).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said where each actuator, driven alone in a few steps, moves so many times as much as is modelled, and the plate rests so
    /// far off (um) while it is driven.
    fn said(times: [f64; ACTUATORS], rest_um: [f64; ACTUATORS]) -> Option<String> {
        sentence(&["single".into()], &[single(times, rest_um)])
    }

    fn single(times: [f64; ACTUATORS], rest_um: [f64; ACTUATORS]) -> Vec<Reading> {
        let mut readings = Vec::new();
        for actuator in 0..ACTUATORS {
            for volts in [0.0_f64, 1.2, 2.4, 3.6] {
                let mut drive = [0.0; ACTUATORS];
                drive[actuator] = volts;
                let modelled = 2.5 * volts * volts;
                // A curve that the model lacks.
                let bend = 0.1 * volts.powi(3);
                readings.push(Reading {
                    interval: 0,
                    t_s: 0.0,
                    drive,
                    measured: times[actuator] * (modelled + bend) + rest_um[actuator],
                    modelled,
                    noise: 0.02,
                });
            }
        }
        readings
    }

    #[test]
    fn a_wild_reading_is_no_stronger_actuator() {
        let mut readings = single([1.0; ACTUATORS], [0.0; ACTUATORS]);
        readings[9].measured -= 5.0;
        assert_eq!(sentence(&["single".into()], &[readings]), None);
    }

    #[test]
    fn one_that_moves_otherwise_than_the_three_others_is_told() {
        let rest = [0.0; ACTUATORS];
        let weak = said([1.04, 1.05, 0.8925, 1.06], rest);
        let told = "single: actuator 3 moves 15 % less than the others say";
        assert_eq!(weak.as_deref(), Some(told));
        let strong = said([1.2, 1.0, 1.0, 1.0], rest);
        let told = "single: actuator 1 moves 20 % more than the others say";
        assert_eq!(strong.as_deref(), Some(told));
    }

    #[test]
    fn nothing_is_told_of_actuators_that_agree_or_all_differ_or_of_a_plate_that_rests_elsewhere() {
        let rest = [0.0; ACTUATORS];
        assert_eq!(said([1.1; ACTUATORS], rest), None);
        assert_eq!(said([1.0, 1.03, 1.0, 1.0], rest), None);
        assert_eq!(said([0.9, 1.0, 1.1, 1.2], rest), None);
        assert_eq!(said([1.0; ACTUATORS], [0.0, 0.0, 0.0, -3.0]), None);
    }

    #[test]
    fn nothing_is_told_where_no_actuator_is_driven_alone() {
        assert_eq!(sentence(&["sweep".into()], &[vec![]]), None);
    }
}
