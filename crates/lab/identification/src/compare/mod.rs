//! Where a model fails a session: per experiment, per stage of the chain, and in sentences.

mod alone;
mod history;
mod jump;
mod ladder;
mod lag;
mod likeness;
mod reading;
mod stages;
mod wild;

use crate::Unit;
use crate::dataset::{Channel, Dataset, Observation};
use crate::prediction::predict;
use mirror_model::{Model, Runaway};
use reading::{Reading, SURE, alone, highest, off, rms};
use serde::Serialize;
use std::fmt;

pub use jump::jumps;
pub use likeness::unlike_heaters;
pub use stages::{StageErrors, StagePoint};
pub use wild::wild_readings;

/// Columns of the course of an error, what the table leaves of a line of 120 in a terminal.
const COURSE: usize = 36;
/// Errors that are smaller are none (um or mA): the last digit that is printed.
const NOTHING: f64 = 1e-3;

/// What is left of one experiment, in [`Comparison::unit`].
#[derive(Clone, Debug, Serialize)]
pub struct ExperimentError {
    /// The experiment.
    pub experiment: String,
    /// Root mean square, measured less modelled.
    pub rms: f64,
    /// The largest, with its sign.
    pub largest: f64,
    /// The drive where it is largest.
    pub largest_at_v: f64,
    /// The actuator that is driven alone there, from 0.
    #[serde(skip)]
    pub largest_at_actuator: Option<usize>,
    /// The time where it is largest, from the file's start.
    pub largest_at_s: f64,
    /// The root mean square in percent of the experiment's span; none where nothing moves.
    pub percent_of_span: Option<f64>,
    /// The error in the course of the experiment: means over equal numbers of rows.
    pub course: Vec<f64>,
    /// Root mean square of the currents' error, where they were measured.
    pub current_rms_ma: Option<f64>,
}

/// A comparison, for people and for `--json`.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// By experiment.
    pub experiments: Vec<ExperimentError>,
    /// Unit of the errors: `um` of displacement, or `mA` where no displacement was measured.
    pub unit: Unit,
    /// By stage, where there is current.
    pub stages: StageErrors,
    /// What a person would say.
    pub sentences: Vec<String>,
    /// Root mean square over the whole session.
    pub rms: f64,
    /// Root mean square of the currents' error over the whole session, where they were measured.
    pub current_rms_ma: Option<f64>,
    /// Rows that were left out because they were more than a fit needs.
    pub thinned_rows: usize,
}

/// Compares a model, as it is, with a session.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn compare(model: &Model, data: &Dataset) -> Result<Comparison, Runaway> {
    let predicted = predict(model, data)?;
    let mut comparison = compare_predicted(model, data, &predicted);
    comparison.sentences.extend(jumps(data, &predicted));
    comparison.sentences.extend(wild_readings(data, &predicted));
    Ok(comparison)
}

/// The same where the model's predictions are known, without the jumps of meters and wild readings, which are looked for in what the
/// user measured against the user's own model.
pub fn compare_predicted(model: &Model, data: &Dataset, predicted: &[f64]) -> Comparison {
    let unit = if data.has_displacement() {
        Unit::Micrometre
    } else {
        Unit::Milliampere
    };
    let readings = readings_of_all(data, predicted);
    let experiments: Vec<_> = readings
        .iter()
        .enumerate()
        .filter_map(|(index, readings)| experiment(data, predicted, readings, index))
        .collect();
    let stages = stages::stages(model, data, predicted);
    let mut sentences: Vec<String> = worst(&experiments, unit).into_iter().collect();
    sentences.extend(unlike(data, &readings));
    sentences.extend(ladder::sentences(data, &readings, unit));
    sentences.extend(history::sentences(data, &readings, unit));
    sentences.extend(lag::sentences(data, &readings, unit));
    sentences.extend(stages.sentences());
    sentences.extend(data.notes.iter().cloned());
    let current_rms_ma = current_rms_ma(data, predicted, |_| true);
    Comparison {
        rms: match current_rms_ma {
            Some(rms) if !data.has_displacement() => rms,
            _ => rms(readings.iter().flatten().map(Reading::error)),
        },
        experiments,
        unit,
        stages,
        sentences,
        current_rms_ma,
        thinned_rows: data.thinned_rows,
    }
}

/// The actuator that moves otherwise than the three others say, against what a model predicts, in a sentence; of currents alone there is none.
pub fn unlike_actuator(data: &Dataset, predicted: &[f64]) -> Option<String> {
    unlike(data, &readings_of_all(data, predicted))
}

/// The same of readings, by experiment.
fn unlike(data: &Dataset, readings: &[Vec<Reading>]) -> Option<String> {
    let moves = data.has_displacement();
    moves.then(|| alone::sentence(&data.experiments, readings))?
}

/// None where no such current was measured.
fn current_rms_ma(
    data: &Dataset,
    predicted: &[f64],
    wanted: impl Fn(&Observation) -> bool,
) -> Option<f64> {
    let seen = data.observations.iter().zip(predicted);
    let errors: Vec<f64> = seen
        .filter(|(o, _)| o.channel != Channel::Displacement && wanted(o))
        .map(|(o, p)| 1e3 * (o.value - p))
        .collect();
    (!errors.is_empty()).then(|| rms(errors.into_iter()))
}

/// The readings of each experiment.
fn readings_of_all(data: &Dataset, predicted: &[f64]) -> Vec<Vec<Reading>> {
    let all = 0..data.experiments.len();
    all.map(|index| readings(data, predicted, index)).collect()
}

/// The displacements of one experiment, or where none was measured the mean currents of its rows.
fn readings(data: &Dataset, predicted: &[f64], index: usize) -> Vec<Reading> {
    let mut readings: Vec<(Reading, f64)> = Vec::new();
    let unit = if data.has_displacement() { 1.0 } else { 1e3 };
    for (o, &modelled) in data.observations.iter().zip(predicted) {
        let shown = (o.channel == Channel::Displacement) == data.has_displacement();
        if o.experiment != index || !shown {
            continue;
        }
        let same_row = readings
            .last_mut()
            .filter(|(last, _)| last.interval == o.interval && last.t_s == o.t_s);
        match same_row {
            Some((reading, channels)) if !data.has_displacement() => {
                let share = 1.0 / (*channels + 1.0);
                reading.measured += share * (unit * o.value - reading.measured);
                reading.modelled += share * (unit * modelled - reading.modelled);
                *channels += 1.0;
            }
            _ => readings.push((
                Reading {
                    interval: o.interval,
                    t_s: o.t_s,
                    drive: data.drive(o),
                    measured: unit * o.value,
                    modelled: unit * modelled,
                    noise: unit * o.noise,
                },
                1.0,
            )),
        }
    }
    readings.into_iter().map(|(reading, _)| reading).collect()
}

fn experiment(
    data: &Dataset,
    predicted: &[f64],
    readings: &[Reading],
    index: usize,
) -> Option<ExperimentError> {
    let worst = readings
        .iter()
        .max_by(|a, b| a.error().abs().total_cmp(&b.error().abs()))?;
    let values = || readings.iter().map(|reading| reading.measured);
    let span = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    let rms = rms(readings.iter().map(Reading::error));
    Some(ExperimentError {
        experiment: data.experiments[index].clone(),
        rms,
        largest: worst.error(),
        largest_at_v: highest(worst.drive),
        largest_at_actuator: alone(worst.drive),
        largest_at_s: worst.t_s,
        percent_of_span: (span > SURE * worst.noise).then(|| 100.0 * rms / span),
        course: course(readings),
        current_rms_ma: current_rms_ma(data, predicted, |o| o.experiment == index),
    })
}

fn course(readings: &[Reading]) -> Vec<f64> {
    let size = readings.len().div_ceil(COURSE).max(1);
    readings
        .chunks(size)
        .map(|chunk| chunk.iter().map(Reading::error).sum::<f64>() / chunk.len() as f64)
        .collect()
}

/// The course of an error as a line of blocks, the lowest block being its most negative value.
fn blocks(course: &[f64]) -> String {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let (low, high) = course.iter().fold((0.0_f64, 0.0_f64), |(low, high), v| {
        (low.min(*v), high.max(*v))
    });
    let level = |v: &f64| (7.0 * (v - low) / (high - low).max(1e-9)).round() as usize;
    course.iter().map(|v| BLOCKS[level(v).min(7)]).collect()
}

fn worst(experiments: &[ExperimentError], unit: Unit) -> Option<String> {
    let worst = experiments
        .iter()
        .max_by(|a, b| a.largest.abs().total_cmp(&b.largest.abs()))?;
    if worst.largest.abs() < NOTHING {
        return Some(format!("no reading is off by {NOTHING} {unit}"));
    }
    let alone = worst.largest_at_actuator;
    let of = alone.map_or(String::new(), |i| format!(" of actuator {} alone", i + 1));
    Some(format!(
        "farthest off in {}: the model is {} at {:.2} V{of}, {} s from its start",
        worst.experiment,
        off(worst.largest, unit),
        worst.largest_at_v,
        (1e4 * worst.largest_at_s).round() / 1e4,
    ))
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit;
        let with_currents = self.unit == Unit::Micrometre && self.current_rms_ma.is_some();
        let heading = if with_currents { "  rms mA" } else { "" };
        writeln!(
            f,
            "  {:<14} {:>9} {:>10} {:>8} {:>10} {:>8}{heading}  measured less modelled, row by row",
            "experiment",
            format!("rms {unit}"),
            format!("largest {unit}"),
            "at V",
            "at s",
            "% span"
        )?;
        for e in &self.experiments {
            let percent = e.percent_of_span.map_or("-".into(), |p| format!("{p:.2}"));
            write!(
                f,
                "  {:<14} {:>9.3} {:>+10.3} {:>8.2} {:>10.4} {percent:>8}",
                e.experiment, e.rms, e.largest, e.largest_at_v, e.largest_at_s,
            )?;
            if with_currents {
                let rms = e
                    .current_rms_ma
                    .map_or("-".into(), |rms| format!("{rms:.4}"));
                write!(f, "{rms:>8}")?;
            }
            writeln!(f, "  {}", blocks(&e.course))?;
        }
        for sentence in &self.sentences {
            writeln!(f, "  {sentence}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_actuator_that_is_alone_where_the_model_is_farthest_off_is_named() {
        let mut data = Dataset::driven([(3.6, 1.0), (3.6, 1.0)])
            .reading(0, Channel::Displacement, 1.0, 0.02)
            .reading(1, Channel::Displacement, 3.4, 0.02);
        data.intervals[1] = mirror_model::Interval::held([0.0, 0.0, 3.6, 0.0], 1.0);
        let experiment = |predicted: [f64; 2]| {
            let readings = readings(&data, &predicted, 0);
            let of_it = experiment(&data, &predicted, &readings, 0).expect("readings");
            worst(&[of_it], Unit::Micrometre).expect("off")
        };
        let said = experiment([1.0, 0.0]);
        assert!(
            said.contains("at 3.60 V of actuator 3 alone, 2 s"),
            "{said}"
        );
        let said = experiment([0.0, 3.4]);
        assert!(said.contains("at 3.60 V, 1 s"), "{said}");
    }
}
