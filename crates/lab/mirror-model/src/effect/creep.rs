//! Metal under stress flows slowly.

mod single;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use single::{SEPARATES, SHOWS, SingleLag};
use std::borrow::Cow;

pub(super) struct Creep;

// The paper saw creep for 30 s: 25 s is the slowest of the three lags at the start. tau from 0.2 s, whose fastest lag of 40 ms
// is that of a thermal pole, to 60 s, whose slowest, 300 s, is ten times what the paper saw. A hundredth of the stroke of 173.7
// um is 1.7 um; a fifth is a choice, far beyond what could be called creep.
static PARAMETERS: [Parameter; 2] = [
    parameter("c", "1", 0.01, 0.0, 0.2),
    parameter("tau", "s", 5.0, 0.2, 60.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("creep"),
    title: Cow::Borrowed("creep"),
    stage: Stage::Memory,
    acts: Acts::Displacement,
    equation: Cow::Borrowed("z' = z + c mean of three lags of z with tau/5, tau, 5 tau"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: SHOWS,
    separates: SEPARATES,
    source: Cow::Borrowed(
        "Kelvin-Voigt elements, close to the logarithm of time; the paper saw it for 30 s",
    ),
};

static OTHERS: [&dyn Effect; 1] = [&SingleLag];

impl Effect for Creep {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "lags"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x + p[0] * (state[0] + state[1] + state[2]) / 3.0
    }

    fn is_inverted(&self) -> bool {
        true
    }

    fn states(&self) -> usize {
        3
    }

    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        for (s, factor) in state.iter_mut().zip([0.2, 1.0, 5.0]) {
            *s = step.relax(*s, factor * p[1]);
        }
    }
}
