//! Room or chip carrier settle to another temperature during a session.

mod simple;

use super::course::Course;
use super::{Acts, Info, Parameter, Stage, parameter};
use std::borrow::Cow;
use std::f64::consts::TAU;

pub(super) static AMBIENT_DRIFT: Course = Course {
    form: "settling-and-swing",
    info: &INFO,
    added: |p, t_s| {
        let (sin, cos) = (TAU * t_s / p[4]).sin_cos();
        p[0] * (1.0 - (-t_s / p[1]).exp() + p[2] * sin + p[3] * (1.0 - cos))
    },
    timing: None,
    others: &[
        &simple::SETTLING,
        &simple::RAMP,
        &simple::STEP,
        &simple::SWING,
    ],
};

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
