//! Chip and package warm by what all heaters give off; all four actuators follow.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct SubstrateWarming;

// w to nearly six times the 7 % of the source, and tau over what a pole of seconds may be: a chip on its package in tenths of a
// second, the package in minutes. Both ends are choices; between them are the 2 to 14 s that the paper's loops and t95 leave
// for a slow pole.
static PARAMETERS: [Parameter; 2] = [
    parameter("w", "1", 0.05, 0.0, 0.4),
    parameter("tau", "s", 5.0, 0.3, 200.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("substrate-warming"),
    title: Cow::Borrowed("the substrate warms"),
    stage: Stage::Heat,
    acts: Acts::Temperature,
    equation: Cow::Borrowed("dT' = dT + s; tau ds/dt = w R_T P_mean - s"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("a slow drift over seconds in z and in R that follows the total power"),
    separates: Cow::Borrowed("heat one actuator and sense an idle one"),
    source: Cow::Borrowed("weights of 5 to 7 %, seconds"),
};

impl Effect for SubstrateWarming {
    fn info(&self) -> &Info {
        &INFO
    }

    fn looks_at_other_actuators(&self) -> bool {
        true
    }

    fn output(&self, _: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x + state[0]
    }

    fn is_inverted(&self) -> bool {
        true
    }

    fn states(&self) -> usize {
        1
    }

    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let m = &step.moment;
        let goal = p[0] * m.thermal_resistance_k_per_w * m.total_power_w / 4.0;
        state[0] = goal + (state[0] - goal) * (-step.duration_s / p[1]).exp();
    }
}
