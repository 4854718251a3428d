//! The conductivity of air, and convection, grow with temperature.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct HeatLossTemperature;

static PARAMETERS: [Parameter; 1] = [parameter("g", "1/K", 1e-3, 0.0, 1e-2)];

static INFO: Info = Info {
    id: Cow::Borrowed("heat-loss-temperature"),
    title: Cow::Borrowed("heat loss grows with temperature"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("R_T' = R_T/(1 + g dT)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "z and R are concave in V, largest misfit near half of the highest drive; P/dT rises with dT",
    ),
    separates: Cow::Borrowed("a steady ladder of V and I; vacuum"),
    source: Cow::Borrowed("air conducts better when hot: g 2e-3 to 4e-3 /K"),
};

impl Effect for HeatLossTemperature {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x - p[0] * (m.temperature_rise_k.powi(2) - m.ambient_k.powi(2))
    }
}
