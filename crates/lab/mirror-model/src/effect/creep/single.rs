//! One element that gives way slowly, as a polymer or an adhesive does.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct SingleLag;

/// As of creep in any form.
pub(super) const SHOWS: Cow<'static, str> = Cow::Borrowed("z goes on for seconds while R stays");
pub(super) const SEPARATES: Cow<'static, str> =
    Cow::Borrowed("hold for a minute: R stays, z moves");

// c as of the three lags. What takes less than 0.2 s is a thermal pole; ten times the 30 s that the paper saw is the slowest of the
// three.
static PARAMETERS: [Parameter; 2] = [
    parameter("c", "1", 0.01, 0.0, 0.2),
    parameter("tau", "s", 15.0, 0.2, 300.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("creep"),
    title: Cow::Borrowed("creep with one time constant"),
    stage: Stage::Memory,
    acts: Acts::Displacement,
    equation: Cow::Borrowed("z' = z + c s; tau ds/dt = z - s"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: SHOWS,
    separates: SEPARATES,
    source: Cow::Borrowed("a Kelvin-Voigt element: an adhesive, a polymer, one process in a film"),
};

impl Effect for SingleLag {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "single"
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x + p[0] * state[0]
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
