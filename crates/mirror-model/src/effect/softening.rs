//! Once strained beyond its yield point the aluminium does not come back: a ratchet.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct Softening;

static PARAMETERS: [Parameter; 2] = [
    parameter("a", "1", 0.02, 0.0, 0.5),
    parameter("T_y", "K", 60.0, 15.0, 150.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("softening"),
    title: Cow::Borrowed("aluminium yields when hot"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed("1/rho' = 1/rho - a (hottest dT so far - T_y), where positive"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "a displacement that stays after the hottest excursion, and only after it",
    ),
    separates: Cow::Borrowed("repeat the sweep"),
    source: Cow::Borrowed("relaxation of Al films above some 80 degC"),
};

impl Effect for Softening {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        let hottest = state[0].max(m.temperature_rise_k);
        x - p[0] * m.curvature_per_k * (hottest - p[1]).max(0.0)
    }

    fn states(&self) -> usize {
        1
    }

    fn advance(&self, _: &[f64], state: &mut [f64], step: &Step) {
        state[0] = state[0].max(step.moment.temperature_rise_k);
    }
}
