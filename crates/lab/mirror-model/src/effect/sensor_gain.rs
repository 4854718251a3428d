//! The sensor's scale is off.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct SensorGain;

// A surface seen 37 degrees from the normal reads 0.8 of its height, cos(37 deg); to start at, a tenth of that.
static PARAMETERS: [Parameter; 1] = [parameter("e", "1", 0.02, -0.2, 0.2)];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-gain"),
    title: Cow::Borrowed("gain of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("z' = z (1 + e)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "a pure scale on z, nothing in the currents: the same as another curvature gain",
    ),
    separates: Cow::Borrowed("a reference step of known height"),
    source: Cow::Borrowed("laser triangulation at an angle, other surfaces"),
};

impl Effect for SensorGain {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        x * (1.0 + p[0])
    }
}
