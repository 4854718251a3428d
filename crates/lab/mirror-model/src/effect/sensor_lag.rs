//! The sensor is late.

mod past;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use past::{LONGEST_S, SEPARATES, SHOWS};
use std::borrow::Cow;

pub(super) struct SensorLag;

// The two lags can be exchanged, so the second is the shorter one.
static PARAMETERS: [Parameter; 2] = [
    parameter("tau", "s", 1e-3, 0.0, LONGEST_S),
    parameter("r", "1", 0.5, 0.0, 1.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-lag"),
    title: Cow::Borrowed("lag of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("tau dy/dt = z - y; r tau dz'/dt = y - z'"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: SHOWS,
    separates: SEPARATES,
    source: Cow::Borrowed("filters in the sensor's electronics"),
};

static OTHERS: [&dyn Effect; 2] = [&past::AVERAGE, &past::DELAY];

impl Effect for SensorLag {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "two-lags"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, _: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x - state[1]
    }

    fn states(&self) -> usize {
        2
    }

    /// The states are how far behind the first lag is, and the reading after both.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let first = |at: f64| at - state[0];
        let (from, to) = (first(step.from), step.relax(first(step.from), p[0]));
        let second = Step { from, to, ..*step };
        state[1] = step.to - second.relax(step.from - state[1], p[0] * p[1]);
        state[0] = step.to - to;
    }
}
