//! The sensor averages.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct SensorLag;

static PARAMETERS: [Parameter; 1] = [parameter("tau", "s", 1e-3, 0.0, 0.3)];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-lag"),
    title: Cow::Borrowed("lag of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("tau dz'/dt = z - z'"),
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
        x - state[0]
    }

    fn states(&self) -> usize {
        1
    }

    /// The state is how far the reading is behind.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        state[0] = step.to - step.relax(step.from - state[0], p[0]);
    }
}
