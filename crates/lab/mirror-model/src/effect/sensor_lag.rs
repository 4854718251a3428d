//! The sensor averages.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct SensorLag;

// 0.3 s is a meter that averages over fifteen periods of 50 Hz mains, a choice; slower readings are taken one by one, and
// nobody would step a drive faster. The two lags can be exchanged, so the second is the shorter one.
static PARAMETERS: [Parameter; 2] = [
    parameter("tau", "s", 1e-3, 0.0, 0.3),
    parameter("r", "1", 0.5, 0.0, 1.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-lag"),
    title: Cow::Borrowed("lag of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("tau dy/dt = z - y; r tau dz'/dt = y - z'"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z is late whatever moves it, R is not; more at higher frequency"),
    separates: Cow::Borrowed("a reference step of a stage of known speed"),
    source: Cow::Borrowed("averaging in the sensor's electronics"),
};

impl Effect for SensorLag {
    fn info(&self) -> &Info {
        &INFO
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
