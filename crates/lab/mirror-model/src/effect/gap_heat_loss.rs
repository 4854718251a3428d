//! The lower the plate and its beams, the thinner the air between them and the substrate.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct GapHeatLoss;

// c is the part of the whole loss that crosses the open gap: most of it at 0.6, a choice; a tenth to start at. The paper's
// plate stands 220 um above its substrate; a recess under it adds to that. 270 um are beyond what any preset moves (222.4 um),
// so that no fit begins with a gap that is closed, and 330 um are half as much again as 220; of 800 um the paper's stroke
// closes a fifth.
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

    fn looks_at_displacement(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let z = m.z_um.clamp(0.0, 0.95 * p[1]);
        x - p[0] * (m.temperature_rise_k - m.ambient_k) * z / (p[1] - z)
    }
}
