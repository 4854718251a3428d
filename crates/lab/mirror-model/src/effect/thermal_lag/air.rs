//! Air, or residue, that stands around the beams warms up behind them and takes a part of their cooling away.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct StagnantAir;

// As warm as the beams it would take no heat at all; half of that is a lid. Air over a hundred micrometres follows in
// milliseconds, over some millimetres in tenths of a second, over two centimetres in two seconds (h^2/(pi^2 a), a = 22 mm^2/s);
// a polymer over a millimetre in a second (a = 0.1 mm^2/s). Ten seconds are a choice: what is slower is the package, and all four share it.
static PARAMETERS: [Parameter; 2] = [
    parameter("w", "1", 0.1, 0.0, 0.6),
    parameter("tau", "s", 0.1, 3e-3, 10.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("thermal-lag"),
    title: Cow::Borrowed("what surrounds the beams warms up behind them"),
    stage: Stage::Heat,
    acts: Acts::Heating,
    equation: Cow::Borrowed("P' = P + w s/R_T; tau ds/dt = dT - s"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed(
        "z and R go on rising together after a step, by a part of what they have risen",
    ),
    separates: Cow::Borrowed("vacuum; a fast R(t) after a step"),
    source: Cow::Borrowed(
        "Newton's law of cooling towards air that is warm itself: G (dT - w s), w a part of the loss",
    ),
};

impl Effect for StagnantAir {
    fn info(&self) -> &Info {
        &INFO
    }

    fn form(&self) -> &str {
        "air"
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        let beam_k = m.temperature_rise_k - m.ambient_k;
        x + p[0] * m.lagged(state[0], p[1], state[1], beam_k)
    }

    fn states(&self) -> usize {
        2
    }

    /// The states are the air's rise, and the beam's at the end of the last step.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let from = state[1];
        let to = step.moment.temperature_rise_k - step.moment.ambient_k;
        state[0] = Step { from, to, ..*step }.relax(state[0], p[1]);
        state[1] = to;
    }
}

#[cfg(test)]
mod tests {
    use crate::effect::{Active, find, forms};
    use crate::{ACTUATORS, Interval, Model, Preset, Symbol, simulate};

    /// A beam of heat capacity C loses G (T - w s) and the air follows: two linear equations,
    /// tau_b T' = q - T + w s, tau s' = T - s, whose eigenvalues and first slopes give T(t) in closed form.
    fn by_hand(q_k: f64, w: f64, tau_b: f64, tau: f64, t: f64) -> f64 {
        let trace = -(1.0 / tau_b + 1.0 / tau);
        let determinant = (1.0 - w) / (tau_b * tau);
        let root = (0.25 * trace * trace - determinant).sqrt();
        let (fast, slow) = (0.5 * trace - root, 0.5 * trace + root);
        let end = q_k / (1.0 - w);
        // T(0) = 0 and T'(0) = q / tau_b: T = end + a e^(fast t) + b e^(slow t).
        let b = (q_k / tau_b + fast * end) / (slow - fast);
        let a = -end - b;
        end + a * (fast * t).exp() + b * (slow * t).exp()
    }

    #[test]
    fn a_step_is_the_solution_of_two_linear_equations() {
        let (w, tau) = (0.2, 0.1);
        let mut model = Model::from(Preset::Paper);
        // A resistance that stays makes the heating a step, and one pole is one beam.
        model.parameters.set(Symbol::FastTime, 5e-3);
        model.parameters.set(Symbol::MiddleWeight, 0.0);
        model.parameters.set(Symbol::SlowWeight, 0.0);
        model.parameters.set(Symbol::ResistanceCoefficient, 1e-9);
        let lag = find("thermal-lag").expect("an effect");
        let air = forms(&lag).into_iter().find(|form| form.form() == "air");
        let mut active = Active::usual(air.expect("a form"));
        active.values = vec![w, tau];
        model.effects.push(active);
        let times = [2e-3, 8e-3, 0.04, 0.15, 0.4];
        let mut last = 0.0;
        let held: Vec<Interval> = times
            .iter()
            .map(|&t| {
                let interval = Interval::held([1.0; ACTUATORS], t - last);
                last = t;
                interval
            })
            .collect();
        let outputs = simulate(&model, &held, 0.25).expect("an answer");
        let p = &model.parameters;
        let q_k = p.thermal_resistance_k_per_w / p.cold_resistance_ohm;
        for (output, t) in outputs.iter().zip(times) {
            let rise_k = output.temperature_rise_k[0];
            let exact = by_hand(q_k, w, 5e-3, tau, t);
            // Inputs run straight between steps that grow with the time since the jump.
            assert!(
                (rise_k / exact - 1.0).abs() < 2e-3,
                "{rise_k} {exact} at {t}"
            );
        }
    }
}
