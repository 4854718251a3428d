//! The air under the plate damps it, the more the narrower it is.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct SqueezeFilm;

// tau is the damper over the four springs. Of the source's damper of a disc, 3 pi eta r^4/(2 h^3), with 18 uPa s, 1 mm across
// and 200 um above the substrate, and of springs with which 0.1 mg ring at 700 Hz, it is 0.3 us, and a thousand times that in a
// tenth of the gap. 0.2 ms is the shortest time between readings of a session; 5 ms is a choice. b is the reciprocal of the gap
// at rest: 1/167 um is less than the paper's plate travels, and below 0 the plate moves away from its substrate.
static PARAMETERS: [Parameter; 2] = [
    parameter("tau", "s", 2e-4, 0.0, 5e-3),
    parameter("b", "1/um", 3e-3, -6e-3, 6e-3),
];

/// The film is never narrower than this part of the gap at rest: roughness, and where the plate would touch.
const NARROWEST: f64 = 0.1;

static INFO: Info = Info {
    id: Cow::Borrowed("squeeze-film"),
    title: Cow::Borrowed("the film of air under the plate"),
    stage: Stage::Motion,
    acts: Acts::Motion,
    equation: Cow::Borrowed("tau/(1 - b z')^3 dz'/dt = z - z'"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z is late by a time that depends on where it is, R is not"),
    separates: Cow::Borrowed("fast steps of one size at two heights; a vacuum"),
    source: Cow::Borrowed("M. Bao and H. Yang, Sens. Actuators A 136 (2007) 3-27: damping ~ 1/h^3"),
};

fn lag_s(p: &[f64], z_um: f64) -> f64 {
    p[0] / (1.0 - p[1] * z_um).max(NARROWEST).powi(3)
}

impl Effect for SqueezeFilm {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, _: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x - state[0]
    }

    fn states(&self) -> usize {
        1
    }

    /// The state is how far the plate is behind. Within a step its film is as wide as halfway.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let before = step.from - state[0];
        let halfway = Step {
            to: 0.5 * (step.from + step.to),
            duration_s: 0.5 * step.duration_s,
            ..*step
        };
        let middle = halfway.relax(before, lag_s(p, before));
        state[0] = step.to - step.relax(before, lag_s(p, middle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a plate is so long after a jump, in steps of a microsecond.
    fn after(p: [f64; 2], from: f64, to: f64, seconds: f64) -> f64 {
        let mut state = [0.0];
        let mut at = from;
        for _ in 0..(seconds / 1e-6).round() as usize {
            let step = Step {
                from: to,
                to,
                duration_s: 1e-6,
                moment: Moment::default(),
            };
            state[0] = to - at;
            SqueezeFilm.advance(&p, &mut state, &step);
            at = SqueezeFilm.output(&p, to, &state, &step.moment);
        }
        at
    }

    #[test]
    fn a_film_that_stays_as_wide_is_a_lag_of_first_order() {
        let at = after([1e-3, 0.0], 0.0, 1.0, 1e-3);
        assert!((at - (1.0 - (-1.0_f64).exp())).abs() < 1e-9, "{at}");
    }

    #[test]
    fn a_small_step_takes_as_long_as_the_film_is_narrow_there() {
        // At 100 um the film is half as wide: eight times as slow. The step moves it by 0.06 % of that, the time by 0.2 %.
        let at = after([1e-3, 5e-3], 100.0, 100.1, 8e-3);
        let share = (at - 100.0) / 0.1;
        assert!((share - (1.0 - (-1.0_f64).exp())).abs() < 2e-3, "{share}");
    }
}
