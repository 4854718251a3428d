//! The first 0 V reading, from which z is counted, was off.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct SensorOffset;

// Half a micrometre is 50 times the resolution of the paper's sensor; 10 um are 4 % of its range, +-250 um. A choice.
static PARAMETERS: [Parameter; 1] = [parameter("z0", "um", 0.5, -10.0, 10.0)];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-offset"),
    title: Cow::Borrowed("offset of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("z' = z + z0"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z is off by the same amount everywhere, also at 0 V"),
    separates: Cow::Borrowed("read 0 V again"),
    source: Cow::Borrowed("zero set on one noisy or creeping reading"),
};

impl Effect for SensorOffset {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        x + p[0]
    }
}
