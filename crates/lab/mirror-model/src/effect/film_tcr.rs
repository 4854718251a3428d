//! Grain boundaries and surfaces scatter electrons whatever the temperature, so thin films have a lower TCR.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct FilmTcr;

// 1 - s is the film's part of the bulk's coefficient; the third of the source is s = 0.67.
static PARAMETERS: [Parameter; 1] = [parameter("s", "1", 0.2, 0.0, 0.7)];

static INFO: Info = Info {
    id: Cow::Borrowed("film-tcr"),
    title: Cow::Borrowed("the film's TCR is not the bulk's"),
    stage: Stage::Resistance,
    acts: Acts::Resistance,
    equation: Cow::Borrowed("R' = R - s R0 xi dT"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("the resistance changes less than it should; nothing in z"),
    separates: Cow::Borrowed("an oven: R at a known temperature with the heater off"),
    source: Cow::Borrowed("thin Pt films have a third to all of the bulk's 3.92e-3 /K"),
};

impl Effect for FilmTcr {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x - p[0] * m.grown_resistance_ohm
    }
}
