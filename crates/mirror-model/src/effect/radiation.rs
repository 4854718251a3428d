//! A grey body in a room.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct Radiation;

static PARAMETERS: [Parameter; 1] = [parameter("k", "W/K^4", 1e-14, 0.0, 1e-13)];

static INFO: Info = Info {
    id: Cow::Borrowed("radiation"),
    title: Cow::Borrowed("radiation"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("P' = P - k ((T0 + dT)^4 - T0^4)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("as a heat loss that grows with temperature, but steepest at the top"),
    separates: Cow::Borrowed("vacuum; much hotter drives"),
    source: Cow::Borrowed("Stefan-Boltzmann: about 1 % of the power at 150 degC"),
};

const AMBIENT_K: f64 = 295.0;

impl Effect for Radiation {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let hot = (AMBIENT_K + m.temperature_rise_k).powi(4) - (AMBIENT_K + m.ambient_k).powi(4);
        x - p[0] * m.thermal_resistance_k_per_w * hot
    }
}
