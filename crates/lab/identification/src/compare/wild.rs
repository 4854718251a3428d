//! Wild readings: single ones that lie far off their neighbours, as a sensor's glitch or a slip of the pen leaves them. They are found by
//! the Hampel identifier (L. Davies, U. Gather, J. Am. Stat. Assoc. 88 (1993) 782; in a moving window: R. K. Pearson, IEEE Trans. Control
//! Syst. Technol. 10 (2002) 55) in what a model leaves: the distance from the median of a moving window, in its median absolute deviations.

use crate::dataset::{Channel, Dataset, Observation};
use crate::digit::last_digit;
use crate::prediction::standard_deviation;
use measurement::held::MEDIAN_OF_NORMAL;
use measurement::{median, median_and_deviation};
use mirror_model::ACTUATORS;
use std::cmp::Ordering;

/// Neighbours on each side that a reading is compared with, and so many at least: Pearson's window of seven.
const SIDE: usize = 3;
const LEAST: usize = 2;
/// A reading is wild so many standard deviations off: those of its neighbours, of the experiment's readings off theirs, and those that every
/// reading is weighed with. Identifiers in use have 3, which noise exceeds once in 370 readings; nothing that is there may be called wild.
const WILD: f64 = 8.0;
/// A drive that moves by a larger part of its range from one reading to the next jumps, and no curve leads over it.
const JUMP: f64 = 0.1;
/// So many are told with their place.
const TOLD: usize = 3;

/// A reading with what the model leaves of it (um or A).
type Left<'a> = (&'a Observation, f64);

/// Where each actuator's drive went from one reading to the next, if none jumped.
type Way = Option<[Ordering; ACTUATORS]>;

/// Single readings that lie far off their neighbours against what a model predicts, in sentences.
pub fn wild_readings(data: &Dataset, predicted: &[f64]) -> Vec<String> {
    let currents = (0..ACTUATORS).map(Channel::Current);
    let channels: Vec<Channel> = [Channel::Displacement]
        .into_iter()
        .chain(currents)
        .collect();
    let mut sentences = Vec::new();
    for experiment in 0..data.experiments.len() {
        for &channel in &channels {
            let of_it = |(o, _): &Left| o.experiment == experiment && o.channel == channel;
            let modelled = data.observations.iter().zip(predicted);
            let readings = modelled.map(|(o, modelled)| (o, o.value - modelled));
            let readings: Vec<Left> = readings.filter(of_it).collect();
            sentences.extend(sentence(data, &readings));
        }
    }
    sentences
}

/// The wild ones among the readings of one quantity in one experiment, the farthest off first.
fn sentence(data: &Dataset, readings: &[Left]) -> Option<String> {
    let pieces = pieces(data, readings);
    let off: Vec<(Left, Off)> = pieces.into_iter().flat_map(off_neighbours).collect();
    if off.is_empty() {
        return None;
    }
    let usual = median(off.iter().map(|(_, off)| off.by.abs()).collect()) / MEDIAN_OF_NORMAL;
    let digit = last_digit(readings.iter().map(|(o, _)| o.value));
    let is_wild = |((o, _), off): &&(Left, Off)| {
        let scale = [off.spread, usual, digit, standard_deviation(o)];
        off.by.abs() > WILD * scale.into_iter().fold(0.0, f64::max)
    };
    let mut wild: Vec<&(Left, Off)> = off.iter().filter(is_wild).collect();
    wild.sort_by(|a, b| b.1.by.abs().total_cmp(&a.1.by.abs()));
    let ((first, _), _) = wild.first()?;
    let (what, unit, times, column) = match first.channel {
        Channel::Displacement => ("displacement".to_owned(), "um", 1.0, "z_um".to_owned()),
        Channel::Current(actuator) => {
            let number = actuator + 1;
            let column = format!("I{number}_A");
            (format!("current of actuator {number}"), "mA", 1e3, column)
        }
    };
    let place = |((o, _), off): &&(Left, Off)| {
        let by = times * off.by;
        match data.is_steady {
            true => format!("{by:+.3} {unit} at {} V", highest_v(data, o)),
            false => format!("{by:+.3} {unit} at {} s", o.t_s),
        }
    };
    let places: Vec<String> = wild.iter().take(TOLD).map(place).collect();
    let more = match wild.len().saturating_sub(TOLD) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(format!(
        "{}: of the {what} {} of {} readings lie{} far off their neighbours, by {}{more}: leave {column} empty there, unless something moved",
        data.experiments[first.experiment],
        wild.len(),
        readings.len(),
        if wild.len() == 1 { "s" } else { "" },
        places.join(", "),
    ))
}

fn highest_v(data: &Dataset, observation: &Observation) -> f64 {
    data.drive(observation).into_iter().fold(0.0, f64::max)
}

/// Readings one after the other at drives that are held, or that move on the same way.
fn pieces<'a, 'o>(data: &Dataset, readings: &'a [Left<'o>]) -> Vec<&'a [Left<'o>]> {
    let drives: Vec<[f64; ACTUATORS]> = readings.iter().map(|(o, _)| data.drive(o)).collect();
    let all = || drives.iter().flatten().copied();
    let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
    let ways = drives.windows(2).map(|pair| -> Way {
        let step = |actuator: usize| pair[1][actuator] - pair[0][actuator];
        let jumps = (0..ACTUATORS).any(|actuator| step(actuator).abs() > JUMP * range);
        (!jumps).then(|| std::array::from_fn(|actuator| step(actuator).total_cmp(&0.0)))
    });
    let (mut pieces, mut begin, mut before) = (Vec::new(), 0, None);
    for (index, way) in ways.enumerate() {
        let goes_on = way.is_some() && (before.is_none() || before == way);
        if !goes_on {
            pieces.push(&readings[begin..=index]);
            begin = index + 1;
        }
        before = way.filter(|_| goes_on);
    }
    pieces.push(&readings[begin..]);
    pieces
}

/// How far a reading is off the median of itself and its neighbours, and the standard deviation that their median absolute deviation
/// stands for.
struct Off {
    by: f64,
    spread: f64,
}

/// The same of every reading of a piece that has neighbours on both sides.
fn off_neighbours<'o>(piece: &[Left<'o>]) -> Vec<(Left<'o>, Off)> {
    let inner = LEAST..piece.len().saturating_sub(LEAST);
    let off = inner.map(|at| {
        let window = &piece[at.saturating_sub(SIDE)..piece.len().min(at + SIDE + 1)];
        let (middle, spread) = median_and_deviation(window.iter().map(|(_, left)| *left));
        let off = Off {
            by: piece[at].1 - middle,
            spread: spread / MEDIAN_OF_NORMAL,
        };
        (piece[at], off)
    });
    off.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scatter that repeats, of about one.
    fn scatter(row: usize) -> f64 {
        [0.4, -1.2, 0.9, 1.1, -0.7, -0.5, 1.3][row % 7]
    }

    /// A mirror that is driven so (V), a second a row, with what a model leaves of each row's reading (um) beside noise of 0.02 um.
    fn said(volts: impl Fn(usize) -> f64, left_um: impl Fn(usize) -> f64) -> Vec<String> {
        let mut data = Dataset::driven((0..60).map(|row| (volts(row), 1.0)));
        let mut predicted = Vec::new();
        for row in 0..60 {
            let z_um = 20.0 * volts(row).powi(2);
            let read = z_um + left_um(row) + 0.02 * scatter(row);
            data = data.reading(row, Channel::Displacement, read, 0.02);
            predicted.push(z_um);
        }
        wild_readings(&data, &predicted)
    }

    /// Holds of twenty rows each.
    fn held(row: usize) -> f64 {
        [1.0, 3.0, 2.0][row / 20]
    }

    fn swept(row: usize) -> f64 {
        0.05 * row as f64
    }

    #[test]
    fn a_wild_reading_is_told_with_its_place() {
        for volts in [held, swept] {
            let told = said(volts, |row| if row == 30 { 5.0 } else { 0.0 });
            assert_eq!(told.len(), 1, "{told:?}");
            let place =
                "made: of the displacement 1 of 60 readings lies far off their neighbours, by +";
            assert!(told[0].starts_with(place), "{told:?}");
            assert!(
                told[0].contains(" um at 31 s: leave z_um empty there"),
                "{told:?}"
            );
        }
        let told = said(held, |row| {
            [0.0, 2.0][usize::from([5, 12, 28, 50].contains(&row))]
        });
        assert!(
            told[0].contains("4 of 60") && told[0].contains(" and 1 more"),
            "{told:?}"
        );
    }

    #[test]
    fn what_a_model_lacks_is_not_wild() {
        // Far off at once after each jump, and slowly further.
        let lags = |row: usize| [9.0, 1.0][row % 20 % 2] * f64::from(u8::from(row % 20 < 2));
        assert_eq!(said(held, lags), [""; 0]);
        let rings = |row: usize| 9.0 * (-0.5_f64).powi((row % 20) as i32);
        assert_eq!(said(held, rings), [""; 0]);
        let creeps = |row: usize| 3.0 * (-((row % 20) as f64) / 4.0).exp();
        assert_eq!(said(held, creeps), [""; 0]);
        // A cusp where the drive turns, a curve with a corner, and one that steps.
        let up_and_down = |row: usize| 0.1 * (30 - (row as i32 - 30).abs()) as f64;
        let cusp = |row: usize| 9.0 * (-((row as f64 - 30.0) / 2.0).abs()).exp();
        assert_eq!(said(up_and_down, cusp), [""; 0]);
        assert_eq!(said(swept, |row| (row as f64 - 30.0).max(0.0)), [""; 0]);
        assert_eq!(said(swept, |row| if row < 30 { 0.0 } else { 2.0 }), [""; 0]);
    }

    #[test]
    fn one_digit_is_not_wild() {
        let mut data = Dataset::driven((0..60).map(|_| (1.0, 1.0)));
        for row in 0..60 {
            let read = if row == 30 { 3.5 } else { 3.0 };
            data = data.reading(row, Channel::Displacement, read, 0.02);
        }
        assert_eq!(wild_readings(&data, &[3.0; 60]), [""; 0]);
    }
}
