//! Drives held one after the other: what the error does along the drive, and in its two directions.

use super::reading::{Reading, off, scale};
use crate::Unit;
use crate::dataset::Dataset;
use mirror_model::ACTUATORS;

/// A drive held for so long (s) is taken as steady: some ten of the time constants of usual mirrors, tens of milliseconds.
pub(super) const STEADY_S: f64 = 0.5;
/// Fewer steps up say nothing of a form.
const STEPS: usize = 5;
/// Where a bend shows most, in parts of the highest drive.
const MIDDLE: f64 = 0.55;
/// A bend by less than this part of the slope is what a wrong scale of a displacement that goes as V^1.7 looks like.
const BEND: f64 = 0.35;

/// Drives and errors, in order.
pub(super) type Branch = Vec<(f64, f64)>;

/// Which actuators a ladder moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moves {
    All,
    One(usize),
}

/// A drive that was held until all but slow things had settled.
pub(super) struct Steady {
    drive: [f64; ACTUATORS],
    pub(super) error: f64,
    pub(super) noise: f64,
}

/// Steady drives one after the other, of all actuators or of one while the others stay.
pub(super) struct Ladder {
    pub(super) moves: Moves,
    pub(super) steps: Vec<Steady>,
}

impl Ladder {
    pub(super) fn drive(&self, step: &Steady) -> f64 {
        step.drive[match self.moves {
            Moves::All => 0,
            Moves::One(actuator) => actuator,
        }]
    }

    /// Drives and errors on the way up, and on the way down.
    pub(super) fn branches(&self) -> (Branch, Branch) {
        let points: Vec<_> = self
            .steps
            .iter()
            .map(|s| (self.drive(s), s.error))
            .collect();
        let top = points.iter().map(|p| p.0).fold(0.0, f64::max);
        let turn = points
            .iter()
            .position(|p| p.0 == top)
            .map_or(0, |at| at + 1);
        let (up, down) = points.split_at(turn);
        (up.to_vec(), down.to_vec())
    }
}

/// The ladders of an experiment that are long enough to have a form.
pub(super) fn ladders(data: &Dataset, readings: &[Reading]) -> Vec<Ladder> {
    let mut ladders: Vec<Ladder> = Vec::new();
    for step in steady(data, readings) {
        let moves = ladders
            .last()
            .and_then(|ladder| moved(&ladder.steps.last()?.drive, &step.drive));
        match (ladders.last_mut(), moves) {
            (Some(ladder), Some(moves)) if ladder.steps.len() == 1 || ladder.moves == moves => {
                ladder.moves = moves;
                ladder.steps.push(step);
            }
            _ => ladders.push(Ladder {
                moves: Moves::All,
                steps: vec![step],
            }),
        }
    }
    ladders.retain(|ladder| ladder.branches().0.len() >= STEPS);
    ladders
}

/// The last reading of every drive that was held long enough.
fn steady(data: &Dataset, readings: &[Reading]) -> Vec<Steady> {
    let mut found = Vec::new();
    let mut since = f64::NEG_INFINITY;
    for (index, reading) in readings.iter().enumerate() {
        let interval = &data.intervals[reading.interval];
        let begin = reading.t_s - interval.duration_s;
        if interval.from_v != interval.to_v {
            since = f64::INFINITY;
        } else if index == 0 || readings[index - 1].drive != reading.drive {
            since = begin;
        }
        let last = readings
            .get(index + 1)
            .is_none_or(|next| next.drive != reading.drive);
        if last && reading.t_s - since >= STEADY_S {
            found.push(Steady {
                drive: reading.drive,
                error: reading.error(),
                noise: reading.noise,
            });
        }
    }
    found
}

/// What moves between two drives: all actuators alike, or one.
fn moved(from: &[f64; ACTUATORS], to: &[f64; ACTUATORS]) -> Option<Moves> {
    let alike = |drive: &[f64; ACTUATORS]| drive.iter().all(|v| *v == drive[0]);
    let moving: Vec<usize> = (0..ACTUATORS).filter(|&a| from[a] != to[a]).collect();
    match moving[..] {
        [actuator] => Some(Moves::One(actuator)),
        _ if alike(from) && alike(to) => Some(Moves::All),
        _ => None,
    }
}

/// One sentence a ladder; ladders of one experiment that say the same say it once.
pub(super) fn sentences(data: &Dataset, readings: &[Vec<Reading>], unit: Unit) -> Vec<String> {
    let mut sentences = Vec::new();
    for (name, readings) in data.experiments.iter().zip(readings) {
        let (_, worth) = scale(readings);
        let mut said: Vec<(Vec<String>, String)> = Vec::new();
        for ladder in ladders(data, readings) {
            let Some(text) = course(&ladder, worth, unit) else {
                continue;
            };
            let place = match ladder.moves {
                Moves::All => name.clone(),
                Moves::One(actuator) => format!("{}", actuator + 1),
            };
            match said.iter_mut().find(|(_, other)| *other == text) {
                Some((places, _)) => places.push(place),
                None => said.push((vec![place], text)),
            }
        }
        for (places, text) in said {
            let place = match &places[..] {
                [only] if only == name => name.clone(),
                [only] => format!("{name}, actuator {only}"),
                several => format!("{name}, actuators {}", several.join(", ")),
            };
            sentences.push(format!("{place}: {text}"));
        }
    }
    sentences
}

/// How the error runs along the drive, and whether it knows the direction; nothing where there is nothing to tell.
fn course(ladder: &Ladder, worth: f64, unit: Unit) -> Option<String> {
    let (up, down) = ladder.branches();
    let worst = ladder
        .steps
        .iter()
        .max_by(|a, b| a.error.abs().total_cmp(&b.error.abs()));
    let mut parts = Vec::new();
    match worst {
        Some(step) if step.error.abs() >= worth && ladder.moves == Moves::All => {
            parts.push(format!(
                "the model is {} at {:.2} V",
                off(step.error, unit),
                ladder.drive(step)
            ));
        }
        _ => {}
    }
    let gap = down
        .iter()
        .filter_map(|&(v, error)| Some(error - between(&up, v)?))
        .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    if down.len() >= 2 {
        parts.push(if gap.abs() < worth {
            "both directions alike, so not memory".into()
        } else {
            let side = if gap > 0.0 { "above" } else { "below" };
            format!(
                "the way down lies up to {:.2} {unit} {side} the way up, so memory or drift",
                gap.abs()
            )
        });
    }
    parts.extend(form(&up, &down, worth).map(String::from));
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The form of the error along the drive, directions averaged.
fn form(up: &[(f64, f64)], down: &[(f64, f64)], worth: f64) -> Option<&'static str> {
    let at = |v: f64| {
        let on = between(up, v).unwrap_or_default();
        between(down, v).map_or(on, |other| 0.5 * (on + other))
    };
    let (low, top) = (up[0].0, up[up.len() - 1].0);
    let middle = low + MIDDLE * (top - low);
    let hump = at(middle) - (1.0 - MIDDLE) * at(low) - MIDDLE * at(top);
    let slope = at(top) - at(low);
    let errors = up.iter().chain(down).map(|p| p.1);
    let mean = errors.clone().sum::<f64>() / (up.len() + down.len()) as f64;
    let largest = errors.map(f64::abs).fold(0.0, f64::max);
    match () {
        () if largest < worth => None,
        () if hump > worth.max(BEND * slope.abs()) => {
            Some("measured above modelled in mid range: concave")
        }
        () if hump < -worth.max(BEND * slope.abs()) => {
            Some("measured below modelled in mid range: convex")
        }
        () if slope.abs() > worth => Some("growing with the drive: a matter of scale"),
        () if mean.abs() > worth => Some("much the same at every drive: an offset, or drift"),
        () => None,
    }
}

/// A curve through points whose first coordinate rises or falls, read at `at`; none outside them.
pub(super) fn between(points: &[(f64, f64)], at: f64) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let ((a, from), (b, to)) = (pair[0], pair[1]);
        let inside = (a.min(b) - 1e-9..=a.max(b) + 1e-9).contains(&at);
        (inside && a != b).then(|| from + (to - from) * (at - a) / (b - a))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_read_between_its_points_and_not_beyond_them() {
        let falling = [(3.0, 30.0), (1.0, 10.0), (0.0, 4.0)];
        assert_eq!(between(&falling, 2.0), Some(20.0));
        assert_eq!(between(&falling, 0.5), Some(7.0));
        assert_eq!(between(&falling, 3.5), None);
        assert_eq!(between(&falling[..1], 3.0), None);
    }

    #[test]
    fn what_moves_is_one_actuator_or_all_alike() {
        let rest = [0.5; ACTUATORS];
        assert_eq!(moved(&rest, &[1.0; ACTUATORS]), Some(Moves::All));
        assert_eq!(moved(&rest, &[0.5, 0.5, 2.0, 0.5]), Some(Moves::One(2)));
        assert_eq!(moved(&rest, &[1.0, 2.0, 0.5, 0.5]), None);
        assert_eq!(moved(&rest, &rest), Some(Moves::All));
    }

    #[test]
    fn a_form_is_a_bend_a_slope_or_an_offset() {
        let up = |error: fn(f64) -> f64| -> Vec<(f64, f64)> {
            let volts = (0..=8).map(|step| 0.25 * f64::from(step));
            volts.map(|v| (v, error(v))).collect()
        };
        let said = |error: fn(f64) -> f64| form(&up(error), &[], 0.1).unwrap_or("nothing");
        assert!(said(|_| 0.05).contains("nothing"));
        assert!(said(|v| v * (2.0 - v)).contains("concave"));
        assert!(said(|v| v * (v - 2.0)).contains("convex"));
        assert!(said(|v| v).contains("scale"));
        assert!(said(|_| 1.0).contains("offset"));
    }
}
