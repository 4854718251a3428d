//! The sensor's curve is bent.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;
use std::f64::consts::TAU;

pub(super) struct SensorNonlinearity;

// n is the error of the slope: of 0.01 and 200 um the waves are 0.3 um, 0.2 % of the paper's range; of 0.15 they are 4.8 um,
// nearly three times the 1 % of the source. Waves of 40 um are the shortest that steps of 7.5 um (0.1 V at 75 um/V) show; of
// 800 um the range is a quarter, a bend without a wave. m, which turns the sine's phase to any, up to that of a bend alone.
static PARAMETERS: [Parameter; 3] = [
    parameter("n", "1", 0.01, -0.15, 0.15),
    parameter("L", "um", 200.0, 40.0, 800.0),
    parameter("m", "1", 0.5, -20.0, 20.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("sensor-nonlinearity"),
    title: Cow::Borrowed("nonlinearity of the sensor"),
    stage: Stage::Sensor,
    acts: Acts::Reading,
    equation: Cow::Borrowed("z' = z + n L/(2 pi) (sin(2 pi z/L) + m (1 - cos(2 pi z/L)))"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "a hump or waves in z over the range, nothing in the currents, the same at any speed",
    ),
    separates: Cow::Borrowed("a reference step at several heights"),
    source: Cow::Borrowed("0.1 to 1 % of the range is usual"),
};

impl Effect for SensorNonlinearity {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        let (sin, cos) = (TAU * x / p[1]).sin_cos();
        x + p[0] * p[1] / TAU * (sin + p[2] * (1.0 - cos))
    }
}
