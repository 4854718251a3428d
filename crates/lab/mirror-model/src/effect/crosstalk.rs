//! Heat flows through the plate and the air from one actuator to another.

mod lagged;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct Crosstalk;

// At most three times the 10 % of the source. The opposite actuator is farther away than a neighbour, so it gets no more than
// that one; half is a choice to start at.
static PARAMETERS: [Parameter; 2] = [
    parameter("k", "1", 0.02, 0.0, 0.3),
    parameter("o", "1", 0.5, 0.0, 1.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("crosstalk"),
    title: Cow::Borrowed("heat from the other actuators"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("R_T P_i' = R_T (P_i + k (both neighbours' P_j + o the opposite P_j))"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "an actuator's misfit follows the power of the others; nearly nothing in z when all are driven",
    ),
    separates: Cow::Borrowed("heat one actuator and sense an idle one"),
    source: Cow::Borrowed("1 to 10 % through plate and frame"),
};

static OTHERS: [&dyn Effect; 3] = [&lagged::FRAME, &lagged::NEIGHBOURS, &lagged::PLATE];

impl Effect for Crosstalk {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "at-once"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn looks_at_other_actuators(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let neighbours_w = m.total_power_w - m.power_w - m.opposite_power_w;
        x + p[0] * m.thermal_resistance_k_per_w * (neighbours_w + p[1] * m.opposite_power_w)
    }
}
