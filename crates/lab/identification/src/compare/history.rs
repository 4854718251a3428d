//! The same drives at another time: whether something stayed, or drifted.

use super::ladder::{Ladder, between, ladders};
use super::{Reading, SURE, scale};
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
