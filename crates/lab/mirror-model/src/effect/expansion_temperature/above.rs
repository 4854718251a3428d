//! A film whose stiffness falls above a temperature, and comes back below it: a polymer at its glass transition, a metal that anneals no more.

use crate::effect::softplus::softplus;
use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct Above;

/// The width over which it sets in (K): films are not equally warm along a beam.
const CORNER_K: f64 = 3.0;

// A bimorph that bends by a tenth less 25 K above the transition, and up to a half less; what stiffens does the other thing. From where a room
// ends to where these mirrors do.
static PARAMETERS: [Parameter; 2] = [
    parameter("c", "1/K", -2e-3, -2e-2, 2e-2),
    parameter("T_g", "K", 70.0, 15.0, 200.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("expansion-temperature"),
    title: Cow::Borrowed("expansion or stiffness change above a temperature"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed("1/rho' = 1/rho (1 + c (3 K) ln(1 + exp((dT - T_g)/3 K)))"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z bends away above one temperature, whatever the height, and comes back"),
    separates: Cow::Borrowed(
        "an oven with the heater off; the same height reached by one actuator",
    ),
    source: Cow::Borrowed("glass transition of polymers; modulus of films"),
};

impl Effect for Above {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "above"
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let beyond_k = CORNER_K * softplus((m.temperature_rise_k - p[1]) / CORNER_K);
        x * (1.0 + p[0] * beyond_k)
    }
}
