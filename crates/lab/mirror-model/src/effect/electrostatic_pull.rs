//! The driven heaters attract the substrate below them.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct ElectrostaticPull;

// Of 3.5 V, 0.1 um/V^2 make 1.2 um; more than 2 um/V^2 would pull such a mirror in. A gap much wider than the stroke is as
// good as none.
static PARAMETERS: [Parameter; 2] = [
    parameter("e", "um/V^2", 0.1, 0.0, 2.0),
    parameter("gap", "um", 330.0, 270.0, 3000.0),
];

/// The part of the gap beyond which it counts as closed.
const CLOSED: f64 = 0.95;

static INFO: Info = Info {
    id: Cow::Borrowed("electrostatic-pull"),
    title: Cow::Borrowed("electrostatic pull towards the substrate"),
    stage: Stage::Shape,
    acts: Acts::Displacement,
    equation: Cow::Borrowed("z' = z + e V^2/(1 - z/gap)^2"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z jumps with the drive, before anything has warmed, and R does not"),
    separates: Cow::Borrowed("a step sampled fast; the substrate at another potential"),
    source: Cow::Borrowed(
        "the force between plates goes as (V/distance)^2 (Senturia, Microsystem Design, chapter 6)",
    ),
};

impl Effect for ElectrostaticPull {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        let open = 1.0 - (x / p[1]).clamp(0.0, CLOSED);
        x + p[0] * (m.voltage_v / open).powi(2)
    }
}
