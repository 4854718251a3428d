//! Room or chip carrier settle to another temperature during a session.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct AmbientDrift;

static PARAMETERS: [Parameter; 2] = [
    parameter("D", "K", 1.0, -15.0, 15.0),
    parameter("tau", "s", 200.0, 30.0, 3000.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("ambient-drift"),
    title: Cow::Borrowed("the surroundings drift"),
    stage: Stage::Heat,
    acts: Acts::Temperature,
    equation: Cow::Borrowed("dT' = dT + D (1 - exp(-t/tau))"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("the same at every drive, follows the clock, also in the cold resistance"),
    separates: Cow::Borrowed("the cold resistance, a thermometer"),
    source: Cow::Borrowed("1.8 um/K"),
};

impl Effect for AmbientDrift {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x + p[0] * (1.0 - (-m.t_s / p[1]).exp())
    }
}
