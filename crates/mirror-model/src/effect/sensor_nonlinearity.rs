//! The sensor's curve is bent.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct SensorNonlinearity;

static PARAMETERS: [Parameter; 1] = [parameter("n", "1", 0.01, -0.05, 0.05)];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-nonlinearity"),
    title: Cow::Borrowed("nonlinearity of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("z' = z + n z (1 - z/200 um)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "a hump in z at mid range, nothing in the currents, the same at any speed",
    ),
    separates: Cow::Borrowed("a reference step at several heights"),
    source: Cow::Borrowed("0.1 to 1 % of the range is usual"),
};

const RANGE_UM: f64 = 200.0;

impl Effect for SensorNonlinearity {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        x + p[0] * x * (1.0 - x / RANGE_UM)
    }
}
