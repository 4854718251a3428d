//! A film that has lost stiffness where it was hottest bends the beam less by the same part everywhere.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct LostStiffness;

/// Kelvins beyond the threshold at which the strength is counted.
const COUNTED_K: f64 = 100.0;

// As of the ratchet, of which it is the one end.
static PARAMETERS: [Parameter; 2] = [
    parameter("a", "1", 0.02, 0.0, 0.5),
    parameter("T_y", "K", 60.0, 15.0, 150.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("softening"),
    title: Cow::Borrowed("aluminium loses stiffness when hot"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed(
        "1/rho' = 1/rho (1 - a (hottest dT so far - T_y)/100 K, where positive)",
    ),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "after the hottest excursion z is less by the same part everywhere, and rest is rest",
    ),
    separates: Cow::Borrowed("repeat the sweep: a ratchet moves the zero, this one does not"),
    source: Cow::Borrowed("recovery and grain growth of Al films above some 80 degC"),
};

impl Effect for LostStiffness {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "stiffness"
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        let hottest = state[0].max(m.temperature_rise_k);
        x * (1.0 - p[0] * (hottest - p[1]).max(0.0) / COUNTED_K)
    }

    fn states(&self) -> usize {
        1
    }

    fn advance(&self, _: &[f64], state: &mut [f64], step: &Step) {
        state[0] = state[0].max(step.moment.temperature_rise_k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curvature_is_less_by_the_same_part_once_it_was_hot() {
        let part = |rise_k: f64, hottest_k: f64| {
            let moment = Moment {
                temperature_rise_k: rise_k,
                ..Moment::default()
            };
            LostStiffness.output(&[0.1, 60.0], 1.0, &[hottest_k], &moment)
        };
        // 10 % for each 100 K beyond 60 K.
        assert_eq!([part(50.0, 0.0), part(0.0, 60.0)], [1.0, 1.0]);
        assert!((part(0.0, 110.0) - 0.95).abs() < 1e-12);
        assert!((part(110.0, 0.0) - 0.95).abs() < 1e-12);
    }
}
