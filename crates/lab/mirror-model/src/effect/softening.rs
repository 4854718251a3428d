//! Once strained beyond its yield point the aluminium does not come back: a ratchet.

mod creep;
mod stiffness;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct Softening;

/// Temperature rise at which a film that has only lost stiffness stands as far back as one that has only yielded (K).
const ALIKE_K: f64 = 100.0;

// Some 80 degC are 58 K above a room of 22 degC. T_y from 15 K, below which a room would anneal the film, to 150 K, beyond the
// 129 K of the paper's mirror at 3.5 V. a: half of what 100 K bend is a choice, far beyond what a mirror survives.
static PARAMETERS: [Parameter; 3] = [
    parameter("a", "1", 0.02, 0.0, 0.5),
    parameter("T_y", "K", 60.0, 15.0, 150.0),
    parameter("s", "1", 0.3, 0.0, 1.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("softening"),
    title: Cow::Borrowed("aluminium yields when hot"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed(
        "1/rho' = 1/rho (1 - s y) - (1 - s) y u 100 K; y = a (hottest dT so far - T_y)/100 K, where positive; u = 1/rho a kelvin",
    ),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "a displacement that stays after the hottest excursion, and only after it",
    ),
    separates: Cow::Borrowed("repeat the sweep"),
    source: Cow::Borrowed("relaxation of Al films above some 80 degC"),
};

static OTHERS: [&dyn Effect; 2] = [&creep::ActivatedCreep, &stiffness::LostStiffness];

impl Effect for Softening {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "ratchet"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        let hottest = state[0].max(m.temperature_rise_k);
        let yielded = p[0] * (hottest - p[1]).max(0.0) / ALIKE_K;
        x - yielded * (p[2] * x + (1.0 - p[2]) * m.curvature_per_k * ALIKE_K)
    }

    fn states(&self) -> usize {
        1
    }

    fn advance(&self, _: &[f64], state: &mut [f64], step: &Step) {
        state[0] = state[0].max(step.moment.temperature_rise_k);
    }
}
