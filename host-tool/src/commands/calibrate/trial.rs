//! How well a board positions: at rest, after a step, and along a sine. Measured before and after.

use measurement::MeasurementFile;
use mirror_protocol::{Quantity, Shape, Waveform};
use serde::Serialize;

use crate::commands::measure::experiment::Experiment;
use crate::commands::measure::run::{Ended, Lab, Measured};
use crate::error::ToolError;
use crate::quantity::Span;

/// Each position at rest is held so long before it is read.
const REST: Span = Span { s: 2.0 };
/// A step is held so long; what is still missing then is creep.
const HOLD: Span = Span { s: 3.0 };
const LOOP_HZ: f32 = 20.0;
const LOOP_CYCLES: u32 = 3;
/// Samples of the loop.
const LOOP_SAMPLES: u32 = 1500;

/// Where the trial goes, as shares of the range: positions that no table was made from.
const REST_SHARES: [f64; 17] = [
    0.52, 0.13, 0.87, 0.31, 0.69, 0.05, 0.95, 0.42, 0.78, 0.22, 0.59, 0.09, 0.91, 0.36, 0.64, 0.17,
    0.82,
];
const STEP_SHARES: (f64, f64) = (0.25, 0.7);
const LOOP_SHARES: (f64, f64) = (0.5, 0.12);

/// What a board reached of what it was asked.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Trial {
    /// Asked and reached at rest (um).
    pub(super) rest: Vec<(f64, f64)>,
    /// Time since a step upwards (s) and z (um), and the positions it goes from and to.
    pub(super) step: Vec<(f64, f64)>,
    pub(super) step_um: (f64, f64),
    /// Asked and reached along a sine (um).
    pub(super) curve: Vec<(f64, f64)>,
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
    /// Largest distance between the two ways of the sine (um).
    pub(super) loop_um: f64,
}

impl Trial {
    /// Tries the board's present calibration up to `top_um`.
    pub(super) async fn run(lab: &mut Lab<'_>, top_um: f64) -> Result<Self, ToolError> {
        let tick_hz = lab.tick_hz();
        let asked = REST_SHARES.map(|share| share * top_um);
        let rest = Experiment::positions("positions", &asked, REST, tick_hz)?.after(5.0);
        let rest = z_of(lab, &rest).await?;
        let (from, to) = (STEP_SHARES.0 * top_um, STEP_SHARES.1 * top_um);
        let step = Experiment::position_steps("steps", &[from, to], HOLD, tick_hz)?.after(5.0);
        let step = z_of(lab, &step).await?;
        let waveform = Waveform {
            quantity: Quantity::Position,
            shape: Shape::Sine {
                frequency_hz: LOOP_HZ,
            },
            offset: (LOOP_SHARES.0 * top_um) as f32,
            amplitude: (LOOP_SHARES.1 * top_um) as f32,
            cycles: LOOP_CYCLES,
            ends_off: true,
        };
        let sine = Experiment::positions_along("sine", waveform, Vec::new(), LOOP_SAMPLES, tick_hz);
        let curve = z_of(lab, &sine.after(5.0)).await?;
        let turn = f64::from(LOOP_HZ) * std::f64::consts::TAU;
        let asked_at =
            |t: f64| f64::from(waveform.offset) + f64::from(waveform.amplitude) * (turn * t).sin();
        // The first cycle begins with a jump from rest.
        let settled = curve.iter().filter(|(t, _)| *t > 1.0 / f64::from(LOOP_HZ));
        Ok(Self {
            rest: asked
                .into_iter()
                .zip(rest.iter().map(|(_, z)| *z))
                .collect(),
            step: step
                .iter()
                .filter(|(t, _)| *t > HOLD.s)
                .map(|(t, z)| (t - HOLD.s, *z))
                .collect(),
            step_um: (from, to),
            curve: settled.map(|(t, z)| (asked_at(*t), *z)).collect(),
        })
    }

    pub(super) fn figures(&self) -> Figures {
        let errors = || self.rest.iter().map(|(asked, reached)| reached - asked);
        let squares: f64 = errors().map(|error| error * error).sum();
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
            rest_rms_um: (squares / self.rest.len().max(1) as f64).sqrt(),
            rest_largest_um: errors().map(f64::abs).fold(0.0, f64::max),
            t95_ms: 1e3 * late.map_or(f64::NAN, |(t, _)| *t),
            overshoot_percent: 100.0 * (highest - end).max(0.0) / (to - from),
            loop_um: loop_width(&self.curve),
        }
    }
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
            curve: curve.collect(),
        };
        let figures = trial.figures();
        assert!((figures.rest_rms_um - 0.125_f64.sqrt()).abs() < 1e-9);
        assert!((figures.rest_largest_um - 0.4).abs() < 1e-9);
        assert!((figures.t95_ms - 300.0).abs() < 2.0, "{}", figures.t95_ms);
        assert!(figures.overshoot_percent < 1e-3);
        // A lag of 0.05 rad opens the middle by twice 30 sin 0.05.
        assert!((figures.loop_um - 3.0).abs() < 0.1, "{}", figures.loop_um);
    }
}
