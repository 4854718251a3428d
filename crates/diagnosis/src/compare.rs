//! Where a model fails a session: per experiment, per stage of the chain, and in sentences.

use crate::fit::predict;
use crate::plan::{Channel, Observation, Plan};
use mirror_model::{ACTUATORS, Model, PistonModel, Runaway};
use serde::Serialize;
use std::fmt;

/// A drive held for so long is taken as steady.
const STEADY_S: f64 = 0.5;
/// Drives that heat next to nothing show the cold resistance.
const COLD_V: f64 = 0.45;
/// Columns of the course of an error in a terminal.
const COURSE: usize = 36;
/// Branches that differ by less than this share of the largest error are alike.
const ALIKE: f64 = 0.25;

/// What is left of one experiment's displacement.
#[derive(Clone, Debug, Serialize)]
pub struct ExperimentError {
    /// The experiment.
    pub experiment: String,
    /// Root mean square, measured less modelled.
    pub rms_um: f64,
    /// The largest, with its sign.
    pub largest_um: f64,
    /// The drive where it is largest.
    pub largest_at_v: f64,
    /// The time where it is largest, from the file's start.
    pub largest_at_s: f64,
    /// The root mean square in percent of the experiment's span.
    pub percent_of_span: f64,
    /// The error in the course of the experiment: means over equal numbers of rows.
    pub course_um: Vec<f64>,
}

/// Steady errors of the chain's links, each taken at the measured input of that link.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageErrors {
    /// Shape: z measured less z modelled at the temperature that the resistance shows, root mean square.
    pub z_at_equal_r_um: Option<f64>,
    /// Heat: the resistance measured against that modelled at the measured power, root mean square in percent.
    pub r_at_equal_p_percent: Option<f64>,
    /// Resistance: the resistance at low drives against the model's, mean in percent.
    pub r_at_low_v_percent: Option<f64>,
}

/// A comparison, for people and for `--json`.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// By experiment.
    pub experiments: Vec<ExperimentError>,
    /// By stage, where there is current.
    pub stages: StageErrors,
    /// What a person would say.
    pub sentences: Vec<String>,
    /// Root mean square over the whole session; in um, or in mA where no displacement was measured.
    pub rms: f64,
}

/// Compares a model, as it is, with a session.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn compare(model: &Model, plan: &Plan) -> Result<Comparison, Runaway> {
    let predicted = predict(model, plan)?;
    let residuals: Vec<f64> = plan
        .observations
        .iter()
        .zip(&predicted)
        .map(|(o, p)| o.value - p)
        .collect();
    let experiments: Vec<_> = (0..plan.experiments.len())
        .filter_map(|index| experiment(plan, &residuals, index))
        .collect();
    let stages = stages(model, plan);
    let sentences = sentences(plan, &residuals, &experiments, &stages);
    let unit = if plan.has_displacement() { 1.0 } else { 1e3 };
    let chosen = residuals.iter().zip(&plan.observations);
    let chosen =
        chosen.filter(|(_, o)| (o.channel == Channel::Displacement) == plan.has_displacement());
    let rms = unit * rms(chosen.map(|(r, _)| *r));
    Ok(Comparison {
        experiments,
        stages,
        sentences,
        rms,
    })
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| {
        (sum + value * value, count + 1)
    });
    (sum / count.max(1) as f64).sqrt()
}

/// The displacements of one experiment with their residuals.
fn displacements<'a>(
    plan: &'a Plan,
    residuals: &'a [f64],
    index: usize,
) -> impl Iterator<Item = (&'a Observation, f64)> {
    let all = plan.observations.iter().zip(residuals.iter().copied());
    all.filter(move |(o, _)| o.experiment == index && o.channel == Channel::Displacement)
}

fn experiment(plan: &Plan, residuals: &[f64], index: usize) -> Option<ExperimentError> {
    let (worst, largest_um) =
        displacements(plan, residuals, index).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let values = || displacements(plan, residuals, index).map(|(o, _)| o.value);
    let span = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    let rms_um = rms(displacements(plan, residuals, index).map(|(_, r)| r));
    Some(ExperimentError {
        experiment: plan.experiments[index].clone(),
        rms_um,
        largest_um,
        largest_at_v: highest(plan.drive(worst)),
        largest_at_s: worst.t_s,
        percent_of_span: 100.0 * rms_um / span.max(1e-9),
        course_um: course(
            &displacements(plan, residuals, index)
                .map(|(_, r)| r)
                .collect::<Vec<_>>(),
        ),
    })
}

fn course(residuals: &[f64]) -> Vec<f64> {
    let size = residuals.len().div_ceil(COURSE).max(1);
    residuals
        .chunks(size)
        .map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64)
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

fn highest(drives: [f64; ACTUATORS]) -> f64 {
    drives.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// One steady instant with all actuators at one drive: drive, mean resistance, and displacement.
fn steady_points(plan: &Plan) -> Vec<(f64, f64, Option<f64>)> {
    let mut points: Vec<(usize, f64, Vec<f64>, Option<f64>)> = Vec::new();
    for o in &plan.observations {
        let interval = &plan.intervals[o.interval];
        let voltage = interval.to_v[0];
        if interval.from_v != [voltage; ACTUATORS]
            || interval.to_v != [voltage; ACTUATORS]
            || interval.duration_s < STEADY_S
            || voltage <= 0.0
        {
            continue;
        }
        if points.last().is_none_or(|point| point.0 != o.interval) {
            points.push((o.interval, voltage, Vec::new(), None));
        }
        let Some(point) = points.last_mut() else {
            continue;
        };
        match o.channel {
            Channel::Displacement => point.3 = Some(o.value),
            Channel::Current(_) if o.value > 20.0 * o.noise => point.2.push(voltage / o.value),
            Channel::Current(_) => {}
        }
    }
    let with_current = points.into_iter().filter(|point| !point.2.is_empty());
    with_current
        .map(|(_, voltage, ohms, z)| (voltage, ohms.iter().sum::<f64>() / ohms.len() as f64, z))
        .collect()
}

fn stages(model: &Model, plan: &Plan) -> StageErrors {
    let points = steady_points(plan);
    let mean = PistonModel {
        parameters: model.parameters,
    };
    let (r0, xi) = (
        mean.parameters.cold_resistance_ohm,
        mean.parameters.resistance_coefficient_per_k,
    );
    let shape: Vec<f64> = points
        .iter()
        .filter_map(|&(_, ohm, z)| Some(z? - mean.displacement_um((ohm / r0 - 1.0) / xi)))
        .collect();
    let heat: Vec<f64> = points
        .iter()
        .map(|&(voltage, ohm, _)| {
            let rise = mean.parameters.thermal_resistance_k_per_w * voltage * voltage / ohm;
            100.0 * (ohm / mean.resistance_ohm(rise) - 1.0)
        })
        .collect();
    let cold: Vec<f64> = points
        .iter()
        .filter(|point| point.0 < COLD_V)
        .map(|&(voltage, ohm, _)| {
            100.0 * (ohm / mean.resistance_ohm(mean.temperature_rise_at_voltage(voltage)) - 1.0)
        })
        .collect();
    let of = |values: &[f64]| (!values.is_empty()).then(|| rms(values.iter().copied()));
    StageErrors {
        z_at_equal_r_um: of(&shape),
        r_at_equal_p_percent: of(&heat),
        r_at_low_v_percent: (!cold.is_empty())
            .then(|| cold.iter().sum::<f64>() / cold.len() as f64),
    }
}

fn sentences(
    plan: &Plan,
    residuals: &[f64],
    experiments: &[ExperimentError],
    stages: &StageErrors,
) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some(worst) = experiments
        .iter()
        .max_by(|a, b| a.largest_um.abs().total_cmp(&b.largest_um.abs()))
    {
        let side = if worst.largest_um > 0.0 {
            "low"
        } else {
            "high"
        };
        sentences.push(format!(
            "the model is too {side} by {:.2} um at {:.1} V in {} ({:.1} % of its span rms)",
            worst.largest_um.abs(),
            worst.largest_at_v,
            worst.experiment,
            worst.percent_of_span
        ));
    }
    for index in 0..plan.experiments.len() {
        sentences.extend(branches(plan, residuals, index));
    }
    sentences.extend(frequency(experiments));
    let (z, r, cold) = (
        stages.z_at_equal_r_um,
        stages.r_at_equal_p_percent,
        stages.r_at_low_v_percent,
    );
    if let (Some(z), Some(r), Some(cold)) = (z, r, cold) {
        sentences.push(format!(
            "by stage: cold resistance off by {cold:+.2} %, resistance at equal power by {r:.2} % rms (heat), z at equal resistance by {z:.2} um rms (curvature, shape, memory or sensor)"
        ));
    }
    sentences
}

/// Memory shows as a difference between the branches of a sweep, a wrong curve as a hump or a slope common to both.
fn branches(plan: &Plan, residuals: &[f64], index: usize) -> Option<String> {
    let rows: Vec<(f64, f64)> = displacements(plan, residuals, index)
        .filter(|(o, _)| plan.intervals[o.interval].duration_s >= STEADY_S)
        .map(|(o, r)| (highest(plan.drive(o)), r))
        .collect();
    let top = rows.iter().map(|row| row.0).fold(0.0, f64::max);
    let turn = rows.iter().position(|row| row.0 == top)?;
    let (up, down) = rows.split_at(turn + 1);
    let largest = rows.iter().map(|row| row.1.abs()).fold(0.0, f64::max);
    if up.len() < 5 || top <= 0.0 || largest <= 0.0 {
        return None;
    }
    let apart: Vec<f64> = down
        .iter()
        .filter_map(|row| {
            up.iter()
                .find(|other| (other.0 - row.0).abs() < 1e-6)
                .map(|other| row.1 - other.1)
        })
        .collect();
    let gap = apart
        .iter()
        .copied()
        .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let memory = match () {
        () if apart.is_empty() => "one direction only",
        () if gap.abs() < ALIKE * largest => "both directions alike, so not memory",
        () => "the two directions differ, so memory or drift",
    };
    let at = |share: f64| {
        up.iter()
            .min_by(|a, b| {
                (a.0 - share * top)
                    .abs()
                    .total_cmp(&(b.0 - share * top).abs())
            })
            .map_or(0.0, |row| row.1)
    };
    let hump = at(0.55) - 0.5 * (at(0.0) + at(1.0));
    let form = match () {
        () if hump > ALIKE * largest => "measured above modelled in mid range: concave",
        () if hump < -ALIKE * largest => "measured below modelled in mid range: convex",
        () => "growing with the drive: a matter of scale",
    };
    Some(format!(
        "{}: {memory} (branches {gap:+.2} um apart at most); {form}",
        plan.experiments[index]
    ))
}

fn frequency(experiments: &[ExperimentError]) -> Option<String> {
    let sines: Vec<_> = experiments
        .iter()
        .filter(|e| e.experiment.starts_with("sine"))
        .collect();
    let (first, last) = (sines.first()?, sines.last()?);
    if sines.len() < 2 {
        return None;
    }
    let trend = match () {
        () if last.rms_um > 1.5 * first.rms_um => {
            "grows with frequency: a lag is missing or too short"
        }
        () if last.rms_um < first.rms_um / 1.5 => "falls with frequency: something slow is missing",
        () => "does not depend on frequency",
    };
    Some(format!(
        "from {} to {} the error goes from {:.2} to {:.2} um rms: it {trend}",
        first.experiment, last.experiment, first.rms_um, last.rms_um
    ))
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  {:<14} {:>9} {:>10} {:>8} {:>10} {:>8}  measured less modelled, row by row",
            "experiment", "rms um", "largest um", "at V", "at s", "% span"
        )?;
        for e in &self.experiments {
            writeln!(
                f,
                "  {:<14} {:>9.3} {:>+10.3} {:>8.2} {:>10.4} {:>8.2}  {}",
                e.experiment,
                e.rms_um,
                e.largest_um,
                e.largest_at_v,
                e.largest_at_s,
                e.percent_of_span,
                blocks(&e.course_um)
            )?;
        }
        for sentence in &self.sentences {
            writeln!(f, "  {sentence}")?;
        }
        Ok(())
    }
}
