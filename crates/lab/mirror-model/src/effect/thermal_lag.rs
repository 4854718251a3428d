//! A part of the heat arrives later.

mod air;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct ThermalLag;

// The paper's loops and t95 ask for a pole of 33 to 39 ms with a weight of 0.29 to 0.43; 0.6 is a choice. A tenth of
// a millisecond is a control tick, and what takes more than a second is the substrate.
static PARAMETERS: [Parameter; 2] = [
    parameter("w", "1", 0.1, 0.0, 0.6),
    parameter("tau", "s", 0.03, 1e-4, 1.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("thermal-lag"),
    title: Cow::Borrowed("one more thermal time constant"),
    stage: Stage::Heat,
    acts: Acts::Temperature,
    equation: Cow::Borrowed("dT' = dT + w (s - dT); tau ds/dt = dT - s"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("a lag in z that vanishes when z is drawn against R"),
    separates: Cow::Borrowed("a fast R(t) after a step"),
    source: Cow::Borrowed("distributed heat looks like this: alone it is no missing physics"),
};

static OTHERS: [&dyn Effect; 1] = [&air::StagnantAir];

impl Effect for ThermalLag {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "pole"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x + p[0] * (state[0] - x)
    }

    fn is_inverted(&self) -> bool {
        true
    }

    fn states(&self) -> usize {
        1
    }

    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        state[0] = step.relax(state[0], p[1]);
    }
}
