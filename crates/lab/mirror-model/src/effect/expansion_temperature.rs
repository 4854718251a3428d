//! The expansion of aluminium grows with temperature, its modulus falls.

mod above;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct ExpansionTemperature;

// From nothing to three times the largest of the source.
static PARAMETERS: [Parameter; 1] = [parameter("c", "1/K", 5e-4, 0.0, 3e-3)];

static INFO: Info = Info {
    id: Cow::Borrowed("expansion-temperature"),
    title: Cow::Borrowed("expansion or stiffness change with temperature"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed("1/rho' = 1/rho (1 + c dT)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z is convex in V, also at equal R"),
    separates: Cow::Borrowed("an oven with the heater off"),
    source: Cow::Borrowed("aluminium: c 0.5e-3 to 1e-3 /K"),
};

static OTHERS: [&dyn Effect; 1] = [&above::Above];

impl Effect for ExpansionTemperature {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "linear"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x * (1.0 + p[0] * m.temperature_rise_k)
    }
}
