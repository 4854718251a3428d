//! The Callendar-Van Dusen term.

use super::{Acts, Effect, Heater, Info, Moment, Parameter, Stage, Strengths, parameter};
use std::borrow::Cow;

pub(super) struct QuadraticTcr;

// From none to four times platinum's.
static PARAMETERS: [Parameter; 1] = [parameter("b", "1/K^2", -5.8e-7, -2.5e-6, 0.0)];

static INFO: Info = Info {
    id: Cow::Borrowed("quadratic-tcr"),
    title: Cow::Borrowed("quadratic term of the resistance"),
    stage: Stage::Resistance,
    acts: Acts::Resistance,
    equation: Cow::Borrowed("R' = R + R0 b dT^2"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "the resistance bends away from a straight line in temperature; nothing in z at equal temperature",
    ),
    separates: Cow::Borrowed("an oven at three temperatures"),
    source: Cow::Borrowed("platinum: -5.8e-7 /K^2 (IEC 60751)"),
};

impl Effect for QuadraticTcr {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x + p[0] * m.cold_resistance_ohm * m.temperature_rise_k * m.temperature_rise_k
    }

    /// Up or down, by half of the straight line's slope at the hottest at most: 2 b dT < xi, or R would stop rising.
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        let most = 0.5 * heater.resistance_coefficient_per_k / heater.hottest_rise_k;
        Some(Strengths {
            usual: -0.1 * most,
            low: -most,
            high: most,
        })
    }
}
