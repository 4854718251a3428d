//! Plate or beams touch something that gives way.

use super::softplus::softplus;
use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct EndStop;

// c is 0 for nothing and 1 for a wall. h over what mirrors reach: 400 um is twice the paper's abstract, and 20 um is three
// steps of a sweep at the top (75 um/V, 0.1 V a step). A rounding w of 0.03 um is a corner to any sensor; 10 um lie
// between the first touch and the last of a plate 1 mm across that is tilted by 0.5 deg. What bends over more is no stop.
static PARAMETERS: [Parameter; 3] = [
    parameter("c", "1", 0.3, 0.0, 1.0),
    parameter("h", "um", 120.0, 20.0, 400.0),
    parameter("w", "um", 3.0, 0.03, 10.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("end-stop"),
    title: Cow::Borrowed("a stop that gives way"),
    stage: Stage::Shape,
    acts: Acts::Displacement,
    equation: Cow::Borrowed("z' = z - c w ln(1 + exp((z - h)/w))"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z falls behind beyond one height, whatever the rate, and R does not"),
    separates: Cow::Borrowed("the same height reached by another drive, or in an oven"),
    source: Cow::Borrowed(
        "a spring in contact takes its share of the travel, rounded where surfaces are rough",
    ),
};

impl Effect for EndStop {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        x - p[0] * p[2] * softplus((x - p[1]) / p[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_below_nothing_is_held_back_and_far_above_its_share() {
        let z = |x: f64| EndStop.output(&[0.25, 100.0, 1.0], x, &[], &Moment::default());
        assert!((z(60.0) - 60.0).abs() < 1e-12);
        assert!((z(180.0) - (180.0 - 0.25 * 80.0)).abs() < 1e-12);
    }
}
