//! The lower the plate and its beams, the thinner the air between them and the substrate.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct GapHeatLoss;

static PARAMETERS: [Parameter; 2] = [
    parameter("c", "1", 0.1, 0.0, 0.6),
    parameter("gap", "um", 330.0, 270.0, 800.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("gap-heat-loss"),
    title: Cow::Borrowed("heat loss to the substrate across the gap"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("P' = P - c dT/R_T z/(gap - z)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("the heat loss follows the displacement, not the temperature"),
    separates: Cow::Borrowed("the same temperature at another height"),
    source: Cow::Borrowed("conduction k A/(gap - z) through air"),
};

impl Effect for GapHeatLoss {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let z = m.z_um.clamp(0.0, 0.95 * p[1]);
        x - p[0] * (m.temperature_rise_k - m.ambient_k) * z / (p[1] - z)
    }
}
