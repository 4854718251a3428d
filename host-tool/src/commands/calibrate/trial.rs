//! How well a board positions: at rest, after a step, and along a sine. Measured before and after.

use measurement::MeasurementFile;
use mirror_protocol::{Quantity, Shape, Waveform};
use serde::Serialize;

use super::effort::Effort;
use crate::commands::measure::experiment::Experiment;
use crate::commands::measure::run::{Ended, Lab, Measured};
use crate::error::ToolError;

/// Samples along a waveform.
const SAMPLES: u32 = 1500;

/// Where the trial goes, as shares of the range: positions that no table was made from.
const REST_SHARES: [f64; 17] = [
    0.52, 0.13, 0.87, 0.31, 0.69, 0.05, 0.95, 0.42, 0.78, 0.22, 0.59, 0.09, 0.91, 0.36, 0.64, 0.17,
    0.82,
];
const STEP_SHARES: (f64, f64) = (0.25, 0.7);

/// A waveform of the trial.
struct Way {
    name: &'static str,
    shape: Shape,
    /// Middle and amplitude, as shares of the range.
    shares: (f64, f64),
    /// The first begins with a jump from rest and is left out.
    cycles: u32,
}

/// The sines leave out the cold end, where no drive is left to cool the mirror with; so does the triangle, and is where a
/// mirror cools fast enough.
const SLOW_LOOP: Way = Way {
    name: "slow loop",
    shape: Shape::Sine { frequency_hz: 1.0 },
    shares: (0.5, 0.12),
    cycles: 3,
};
const LOOP: Way = Way {
    name: "loop",
    shape: Shape::Sine { frequency_hz: 20.0 },
    ..SLOW_LOOP
};
const TRIANGLE: Way = Way {
    name: "triangle",
    shape: Shape::Triangle { frequency_hz: 20.0 },
    shares: (0.35, 0.115),
    cycles: 6,
};

/// What a board reached of what it was asked.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Trial {
    /// Asked and reached at rest (um).
    pub(super) rest: Vec<(f64, f64)>,
    /// Time since a step upwards (s) and z (um), and the positions it goes from and to.
    pub(super) step: Vec<(f64, f64)>,
    pub(super) step_um: (f64, f64),
    /// Asked and reached along a sine of 1 Hz, and of 20 Hz (um).
    pub(super) slow_loop: Vec<(f64, f64)>,
    pub(super) curve: Vec<(f64, f64)>,
    /// Asked and reached along a triangle of 20 Hz, and from its bottom to its top (um).
    pub(super) triangle: Vec<(f64, f64)>,
    pub(super) triangle_um: f64,
}

/// A trial in numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Figures {
    pub(super) rest_rms_um: f64,
    pub(super) rest_largest_um: f64,
    /// Until z stays within 5 % of the step.
    pub(super) t95_ms: f64,
    /// Beyond the target, in per cent of the step.
    pub(super) overshoot_percent: f64,
    /// Largest distance between the two ways of the sine of 1 Hz (um).
    pub(super) slow_loop_um: f64,
    /// The same of the sine of 20 Hz.
    pub(super) loop_um: f64,
    /// From the bottom to the top of the triangle of 20 Hz (um).
    pub(super) triangle_um: f64,
    /// Error along it.
    pub(super) triangle_rms_um: f64,
}

/// The trial up to `top_um`: rest, a step, two sines, a triangle.
pub(super) fn experiments(
    effort: &Effort,
    top_um: f64,
    tick_hz: u32,
) -> Result<[Experiment; 5], ToolError> {
    let rests: Vec<f64> = rest_shares(effort).map(|share| share * top_um).collect();
    let (from, to) = STEP_SHARES;
    let step = [from * top_um, to * top_um];
    let along = |way: Way| {
        let waveform = way.waveform(top_um);
        Experiment::positions_along(way.name, waveform, Vec::new(), SAMPLES, tick_hz)
    };
    let experiments = [
        Experiment::positions("rest", &rests, effort.rest, tick_hz)?,
        Experiment::position_steps("step", &step, effort.hold, tick_hz)?,
        along(SLOW_LOOP),
        along(LOOP),
        along(TRIANGLE),
    ];
    Ok(experiments.map(|experiment| experiment.after(effort.cooling_s)))
}

/// The positions at rest, scattered over the range however few they are.
fn rest_shares(effort: &Effort) -> impl Iterator<Item = f64> + use<> {
    REST_SHARES.into_iter().take(effort.rests)
}

impl Way {
    fn waveform(&self, top_um: f64) -> Waveform {
        Waveform {
            quantity: Quantity::Position,
            shape: self.shape,
            offset: (self.shares.0 * top_um) as f32,
            amplitude: (self.shares.1 * top_um) as f32,
            cycles: self.cycles,
            ends_off: true,
        }
    }
}

impl Trial {
    /// Tries the board's present calibration up to `top_um`. `when` is shown.
    pub(super) async fn run(
        lab: &mut Lab<'_>,
        effort: &Effort,
        when: &str,
        top_um: f64,
    ) -> Result<Self, ToolError> {
        let tick_hz = lab.tick_hz();
        let [rest, step, slow_loop, curve, triangle] =
            experiments(effort, top_um, tick_hz)?.map(|experiment| {
                experiment
                    .clone()
                    .named(&format!("{}, {when}", experiment.name))
            });
        let rest = z_of(lab, &rest).await?;
        let step = z_of(lab, &step).await?;
        Ok(Self {
            rest: rest_shares(effort)
                .zip(rest)
                .map(|(share, (_, z))| (share * top_um, z))
                .collect(),
            step: step
                .iter()
                .filter(|(t, _)| *t > effort.hold.s)
                .map(|(t, z)| (t - effort.hold.s, *z))
                .collect(),
            step_um: (STEP_SHARES.0 * top_um, STEP_SHARES.1 * top_um),
            slow_loop: asked_and_reached(lab, &slow_loop).await?,
            curve: asked_and_reached(lab, &curve).await?,
            triangle: asked_and_reached(lab, &triangle).await?,
            triangle_um: 2.0 * TRIANGLE.shares.1 * top_um,
        })
    }

    pub(super) fn figures(&self) -> Figures {
        let rms = |errors: &[f64]| {
            let squares: f64 = errors.iter().map(|error| error * error).sum();
            (squares / errors.len().max(1) as f64).sqrt()
        };
        let (from, to) = self.step_um;
        // What it comes to in the end is the position table's matter, not the step's.
        let end = mean_of_last(&self.step);
        let size = end - from;
        let late = self
            .step
            .iter()
            .rev()
            .take_while(|(_, z)| (z - end).abs() <= 0.05 * size.abs())
            .last();
        let highest = self.step.iter().map(|(_, z)| *z).fold(f64::MIN, f64::max);
        Figures {
            rest_rms_um: rms(&errors(&self.rest)),
            rest_largest_um: errors(&self.rest)
                .into_iter()
                .map(f64::abs)
                .fold(0.0, f64::max),
            t95_ms: 1e3 * late.map_or(f64::NAN, |(t, _)| *t),
            overshoot_percent: 100.0 * (highest - end).max(0.0) / (to - from),
            slow_loop_um: loop_width(&self.slow_loop),
            loop_um: loop_width(&self.curve),
            triangle_um: self.triangle_um,
            triangle_rms_um: rms(&errors(&self.triangle)),
        }
    }
}

fn errors(pairs: &[(f64, f64)]) -> Vec<f64> {
    pairs
        .iter()
        .map(|(asked, reached)| reached - asked)
        .collect()
}

/// Plays an experiment along a waveform of positions, and returns what was asked and reached after its first cycle.
async fn asked_and_reached(
    lab: &mut Lab<'_>,
    experiment: &Experiment,
) -> Result<Vec<(f64, f64)>, ToolError> {
    let reached = z_of(lab, experiment).await?;
    let asked = experiment.asked(lab.tick_hz());
    let pairs = reached.into_iter().filter_map(|(t_s, z)| {
        // A row is read as its tick begins: where the tick before was asked to end.
        let tick = (t_s * f64::from(lab.tick_hz())).round() as usize;
        Some((*asked.get(tick.checked_sub(1)?)?, z, tick))
    });
    let cycles = experiment.runs.iter().map(|run| run.waveform.cycles);
    let first_cycle = asked.len() / cycles.sum::<u32>().max(1) as usize;
    Ok(pairs
        .filter(|(_, _, tick)| *tick > first_cycle)
        .map(|(asked, z, _)| (asked, z))
        .collect())
}

/// Plays an experiment and returns time and z of its rows.
pub(super) async fn z_of(
    lab: &mut Lab<'_>,
    experiment: &Experiment,
) -> Result<Vec<(f64, f64)>, ToolError> {
    let file = complete(lab.measure(experiment).await)?;
    let rows = file.rows.iter();
    let found: Vec<_> = rows.filter_map(|row| Some((row.t_s, row.z_um?))).collect();
    if found.is_empty() {
        Err(ToolError::NoSensor)
    } else {
        Ok(found)
    }
}

/// The file of a measurement that nobody interrupted.
pub(super) fn complete(measured: Measured) -> Result<MeasurementFile, ToolError> {
    match measured.ended? {
        Ended::Interrupted => Err(ToolError::Interrupted),
        Ended::Complete => Ok(measured.file),
    }
}

/// Of the last quarter of the time.
fn mean_of_last(step: &[(f64, f64)]) -> f64 {
    let from = 0.75 * step.last().map_or(0.0, |(t, _)| *t);
    let late: Vec<f64> = step
        .iter()
        .filter(|(t, _)| *t >= from)
        .map(|(_, z)| *z)
        .collect();
    late.iter().sum::<f64>() / late.len().max(1) as f64
}

/// Largest distance between the way up and the way down at the same asked position.
fn loop_width(curve: &[(f64, f64)]) -> f64 {
    const BINS: usize = 40;
    let (low, high) = curve.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (asked, _)| (low.min(*asked), high.max(*asked)),
    );
    let mut ways = [[(0.0, 0.0); BINS]; 2];
    for pair in curve.windows(2) {
        let (asked, reached) = pair[1];
        let way = usize::from(asked > pair[0].0);
        let bin = ((asked - low) / (high - low) * BINS as f64) as usize;
        let slot: &mut (f64, f64) = &mut ways[way][bin.min(BINS - 1)];
        slot.0 += reached - asked;
        slot.1 += 1.0;
    }
    // Near the turns a bin holds too little of one way.
    (BINS / 10..BINS - BINS / 10)
        .filter(|&bin| ways[0][bin].1 > 0.0 && ways[1][bin].1 > 0.0)
        .map(|bin| {
            let mean = |way: usize| ways[way][bin].0 / ways[way][bin].1;
            (mean(1) - mean(0)).abs()
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_a_known_step_and_loop() {
        let lag = |t: f64| 20.0 + 80.0 * (1.0 - (-t / 0.1).exp());
        let step = (0..3000).map(|i| f64::from(i) * 1e-3).map(|t| (t, lag(t)));
        let turn = |i: u32| f64::from(i) * 0.01;
        let curve = (0..1257).map(|i| (30.0 * turn(i).sin(), 30.0 * (turn(i) - 0.05).sin()));
        let trial = Trial {
            rest: vec![(10.0, 10.3), (20.0, 19.6)],
            step: step.collect(),
            step_um: (20.0, 100.0),
            slow_loop: vec![(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)],
            curve: curve.collect(),
            triangle: vec![(40.0, 40.3), (60.0, 59.6)],
            triangle_um: 40.0,
        };
        let figures = trial.figures();
        assert!((figures.rest_rms_um - 0.125_f64.sqrt()).abs() < 1e-9);
        assert!((figures.triangle_rms_um - 0.125_f64.sqrt()).abs() < 1e-9);
        assert!((figures.rest_largest_um - 0.4).abs() < 1e-9);
        assert!((figures.t95_ms - 300.0).abs() < 2.0, "{}", figures.t95_ms);
        assert!(figures.overshoot_percent < 1e-3);
        // A lag of 0.05 rad opens the middle by twice 30 sin 0.05.
        assert!((figures.loop_um - 3.0).abs() < 0.1, "{}", figures.loop_um);
    }
}
