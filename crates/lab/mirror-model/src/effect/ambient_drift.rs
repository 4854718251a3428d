//! Room or chip carrier settle to another temperature during a session.

mod simple;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;
use std::f64::consts::TAU;

pub(super) struct AmbientDrift;

// D, tau and T as in the forms of their own (`simple.rs`), T and tau between theirs. Both swings are counted in parts of D, and
// may be ten times what settles: a choice, for a room that swings and hardly settles.
static PARAMETERS: [Parameter; 5] = [
    parameter("D", "K", 1.0, -15.0, 15.0),
    parameter("tau", "s", 200.0, 30.0, 3000.0),
    parameter("s", "1", 0.1, -10.0, 10.0),
    parameter("c", "1", 0.1, -10.0, 10.0),
    parameter("T", "s", 200.0, 10.0, 1500.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("ambient-drift"),
    title: Cow::Borrowed("the surroundings drift"),
    stage: Stage::Heat,
    acts: Acts::Temperature,
    equation: Cow::Borrowed(
        "dT' = dT + D (1 - exp(-t/tau) + s sin(2 pi t/T) + c (1 - cos(2 pi t/T)))",
    ),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("the same at every drive, follows the clock, also in the cold resistance"),
    separates: Cow::Borrowed("the cold resistance, a thermometer"),
    source: Cow::Borrowed("1.8 um/K"),
};

static OTHERS: [&dyn Effect; 4] = [
    &simple::SETTLING,
    &simple::RAMP,
    &simple::STEP,
    &simple::SWING,
];

impl Effect for AmbientDrift {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "settling-and-swing"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn is_of_time(&self) -> bool {
        true
    }

    fn is_course(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let (sin, cos) = (TAU * m.t_s / p[4]).sin_cos();
        x + p[0] * (1.0 - (-m.t_s / p[1]).exp() + p[2] * sin + p[3] * (1.0 - cos))
    }
}
