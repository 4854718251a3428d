//! Surroundings that drift in one simple way.

use crate::effect::course::{self, Course};
use crate::effect::{Acts, Info, Parameter, Stage, Timing, parameter};
use std::borrow::Cow;
use std::f64::consts::PI;

/// A door that opens changes a room's air in some seconds (s).
const OPENING_S: f64 = 5.0;

pub(super) static SETTLING: Course = Course {
    form: "settling",
    info: &SETTLES,
    added: course::settling,
    timing: None,
    others: &[],
};

pub(super) static RAMP: Course = Course {
    form: "ramp",
    info: &RAMPS,
    added: course::ramp,
    timing: None,
    others: &[],
};

pub(super) static STEP: Course = Course {
    form: "step",
    info: &STEPS,
    added: |p, t_s| course::step(p, t_s, OPENING_S),
    timing: Some(Timing::Onset),
    others: &[],
};

pub(super) static SWING: Course = Course {
    form: "periodic",
    info: &SWINGS,
    added: course::swing,
    timing: Some(Timing::Period),
    others: &[],
};

const fn info(equation: &'static str, source: &'static str, values: &'static [Parameter]) -> Info {
    Info {
        id: Cow::Borrowed("ambient-drift"),
        title: Cow::Borrowed("the surroundings drift"),
        stage: Stage::Heat,
        acts: Acts::Temperature,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(values),
        shows: Cow::Borrowed(
            "the same at every drive, follows the clock, also in the cold resistance",
        ),
        separates: Cow::Borrowed("the cold resistance, a thermometer"),
        source: Cow::Borrowed(source),
    }
}

// Of a session of minutes: rooms and carriers settle by some kelvins, within minutes to an hour; heating and air conditioning
// swing every one to twenty-five minutes, a stage that is held at a temperature every ten seconds and more.
static SETTLING_VALUES: [Parameter; 2] = [
    parameter("D", "K", 1.0, -15.0, 15.0),
    parameter("tau", "s", 200.0, 30.0, 3000.0),
];
static SETTLES: Info = info(
    "dT' = dT + D (1 - exp(-t/tau))",
    "Newton's law of cooling of a room or carrier; 1.8 um/K",
    &SETTLING_VALUES,
);
static RAMP_VALUES: [Parameter; 1] = [parameter("g", "K/ks", 3.0, -50.0, 50.0)];
static RAMPS: Info = info(
    "dT' = dT + g t",
    "the begin of a settling that takes much longer than the session; 1.8 um/K",
    &RAMP_VALUES,
);
static STEP_VALUES: [Parameter; 2] = [
    parameter("D", "K", 0.5, -15.0, 15.0),
    parameter("t_0", "s", 150.0, 1.0, 1e4),
];
static STEPS: Info = info(
    "dT' = dT + D (1 + tanh((t - t_0)/5 s))/2",
    "a door or a window; 1.8 um/K",
    &STEP_VALUES,
);
static SWING_VALUES: [Parameter; 3] = [
    parameter("D", "K", 0.2, -5.0, 5.0),
    parameter("T", "s", 200.0, 10.0, 1500.0),
    parameter("p", "rad", 1.0, -PI, PI),
];
static SWINGS: Info = info(
    "dT' = dT + D (sin(2 pi t/T + p) - sin p)",
    "a thermostat that switches, a stage's own controller; 1.8 um/K",
    &SWING_VALUES,
);
