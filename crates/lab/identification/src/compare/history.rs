//! The same drives at another time: whether something stayed, or drifted.

use super::ladder::{Ladder, between, ladders};
use super::reading::{Reading, SURE, scale};
use crate::Unit;
use crate::dataset::Dataset;

/// One sentence for every experiment that repeats the way up of an earlier one.
pub(super) fn sentences(data: &Dataset, readings: &[Vec<Reading>], unit: Unit) -> Vec<String> {
    let mut sentences = Vec::new();
    let mut earlier: Vec<(&str, Ladder)> = Vec::new();
    for (name, readings) in data.experiments.iter().zip(readings) {
        for ladder in ladders(data, readings) {
            let first = earlier
                .iter()
                .find(|(other, first)| *other != name.as_str() && first.moves == ladder.moves);
            match first {
                Some((other, first)) => {
                    let (_, worth) = scale(readings);
                    sentences
                        .extend(repeated(first, &ladder, worth, unit).map(|said| {
                            format!("{name}, against {other} at equal drives: {said}")
                        }));
                }
                None => earlier.push((name.as_str(), ladder)),
            }
        }
    }
    sentences
}

fn repeated(first: &Ladder, again: &Ladder, worth: f64, unit: Unit) -> Option<String> {
    let (before, _) = first.branches();
    let (after, _) = again.branches();
    let changes: Vec<(f64, f64)> = after
        .iter()
        .filter_map(|&(v, error)| Some((v, error - between(&before, v)?)))
        .collect();
    let &(_, low) = changes.first()?;
    let &(_, top) = changes.last()?;
    let mean = changes.iter().map(|c| c.1).sum::<f64>() / changes.len() as f64;
    let largest = changes.iter().map(|c| c.1.abs()).fold(0.0, f64::max);
    let noise = again
        .steps
        .iter()
        .map(|step| step.noise)
        .fold(0.0, f64::max);
    if largest < worth.max(SURE * noise) {
        return Some(format!("the same within {largest:.2} {unit}"));
    }
    let form = if (top - low).abs() < 0.5 * mean.abs() {
        "alike at all drives: the ambient, an offset, or what was bent and stays bent"
    } else {
        "not alike at all drives: creep, or what heat has changed for good"
    };
    Some(format!("{mean:+.2} {unit} in the mean, {form}"))
}

#[cfg(test)]
mod tests {
    use mirror_model::{ACTUATORS, Interval};

    use super::*;

    const DRIVES_V: [f64; 6] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];

    /// Two ways up through the same drives, each held for a second; the second is off by `change` at each drive (V).
    fn told(change: fn(f64) -> f64) -> Vec<String> {
        let held = |volts: f64| Interval::held([volts; ACTUATORS], 1.0);
        let data = Dataset {
            intervals: DRIVES_V.into_iter().cycle().take(12).map(held).collect(),
            experiments: vec!["sweep".into(), "again".into()],
            ..Dataset::default()
        };
        let reading = |interval: usize| {
            let volts = DRIVES_V[interval % 6];
            let off = if interval < 6 { 0.0 } else { change(volts) };
            Reading {
                interval,
                t_s: (interval % 6 + 1) as f64,
                drive: [volts; ACTUATORS],
                measured: 10.0 * volts + off,
                modelled: 10.0 * volts,
                noise: 0.01,
            }
        };
        let readings = [0..6, 6..12].map(|rows| rows.map(reading).collect());
        sentences(&data, &readings, Unit::Micrometre)
    }

    #[test]
    fn what_comes_back_is_the_same() {
        assert_eq!(
            told(|_| 0.02),
            ["again, against sweep at equal drives: the same within 0.02 um"]
        );
    }

    #[test]
    fn an_offset_is_alike_at_all_drives() {
        let said = told(|_| 1.0);
        assert!(
            said[0].contains("+1.00 um in the mean, alike at all drives"),
            "{said:?}"
        );
    }

    #[test]
    fn what_grows_with_the_drive_is_not_alike() {
        let said = told(|volts| -volts);
        // The mean of 0.5 to 3.
        assert!(
            said[0].contains("-1.75 um in the mean, not alike"),
            "{said:?}"
        );
    }
}
