//! A film that relaxes while it is hot, faster the hotter: what the aluminium's expansion strained, it gives up.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct ActivatedCreep;

/// Temperature rise at which the rate is counted (K): about the paper's mirror's at high drives.
const COUNTED_K: f64 = 100.0;
/// Rates beyond this many e-folds from the counted one are held there: a mirror that is this hot has long yielded.
const E_FOLDS: f64 = 20.0;

// An e-fold of an Arrhenius rate is k T^2/Q: 9 K for 1.5 eV (self-diffusion of aluminium) and 27 K for 0.5 eV (along its grain
// boundaries) at 400 K. A rate of 2e-3 /s relaxes a fifth in the 100 s for which a session is hot.
static PARAMETERS: [Parameter; 2] = [
    parameter("a", "1/s", 2e-3, 0.0, 0.3),
    parameter("w", "K", 20.0, 8.0, 50.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("softening"),
    title: Cow::Borrowed("aluminium relaxes when hot"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed(
        "1/rho' = 1/rho - y u 100 K; dy/dt = a exp((dT - 100 K)/w) (dT/100 K - y); u = 1/rho a kelvin",
    ),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "z falls while it is held hot, and a displacement stays that grows with the time spent there",
    ),
    separates: Cow::Borrowed("hold at the highest drive, then read the zero again"),
    source: Cow::Borrowed(
        "stress relaxation of Al films, thermally activated (Gardner and Flinn, IEEE Trans. Electron Devices 35 (1988) 2160)",
    ),
};

impl Effect for ActivatedCreep {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "creep"
    }

    fn output(&self, _: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        x - state[0] * m.curvature_per_k * COUNTED_K
    }

    fn states(&self) -> usize {
        1
    }

    /// Exact while the temperature stands.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let rise_k = step.moment.temperature_rise_k;
        let folds = ((rise_k - COUNTED_K) / p[1]).clamp(-E_FOLDS, E_FOLDS);
        let goal = rise_k / COUNTED_K;
        let left = (-p[0] * folds.exp() * step.duration_s).exp();
        state[0] = goal + (state[0] - goal) * left;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(state: f64, rise_k: f64, seconds: f64) -> f64 {
        let mut state = [state];
        let moment = Moment {
            temperature_rise_k: rise_k,
            ..Moment::default()
        };
        let step = Step {
            from: 0.0,
            to: 0.0,
            duration_s: seconds,
            moment,
        };
        ActivatedCreep.advance(&[2e-3, 20.0], &mut state, &step);
        state[0]
    }

    #[test]
    fn a_hold_relaxes_as_an_exponential_whose_rate_is_activated() {
        // At 100 K the rate is that of the parameter: 1 - e^-0.2 of the strain in 100 s.
        let relaxed = 1.0 - (-0.2_f64).exp();
        assert!((held(0.0, 100.0, 100.0) - relaxed).abs() < 1e-12);
        // 20 K hotter it is e times as fast.
        let hotter = 1.2 * (1.0 - (-0.2 * std::f64::consts::E).exp());
        assert!((held(0.0, 120.0, 100.0) - hotter).abs() < 1e-12);
        // Cold it stays: 2e-3 e^-5 is 1.3e-5 /s.
        let cold = 0.2 * (-2e-3 * (-5.0_f64).exp() * 100.0).exp();
        assert!((held(0.2, 0.0, 100.0) - cold).abs() < 1e-12);
    }

    #[test]
    fn what_relaxed_is_missing_from_the_curvature() {
        let moment = Moment {
            curvature_per_k: 2e-6,
            ..Moment::default()
        };
        let curvature = ActivatedCreep.output(&[2e-3, 20.0], 1e-4, &[0.1], &moment);
        assert!((curvature - (1e-4 - 0.1 * 2e-6 * 100.0)).abs() < 1e-18);
    }
}
