//! Rate-independent hysteresis, as of friction: Prandtl-Ishlinskii play operators (Kuhnen, Modeling, identification and
//! compensation of complex hysteretic nonlinearities, 2003).

mod friction;

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

/// Play operators on the displacement of each actuator, or on the plate's.
pub(super) struct Plays {
    form: &'static str,
    info: &'static Info,
}

pub(super) static OF_ACTUATORS: Plays = Plays {
    form: "play",
    info: &INFO,
};

/// Driven alone, an actuator moves four times as far as the plate, and its films' play is four times as narrow beside it.
static OF_THE_PLATE: Plays = Plays {
    form: "plate",
    info: &INFO_OF_THE_PLATE,
};

// Once all plays follow, the loop is 4/3 w r high at its middle (twice the held back mean radius of 2r/3), which starts at 0.27
// um, a sixth of the paper's loop of 1.6 um at 0.1 Hz. The ends are choices: a radius of 60 um is a third of the paper's 173.7
// um, and one of 0.5 um turns within a step of any sweep.
static PARAMETERS: [Parameter; 2] = [
    parameter("w", "1", 0.02, 0.0, 0.3),
    parameter("r", "um", 10.0, 0.5, 60.0),
];

const fn info(acts: Acts, equation: &'static str, separates: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("hysteresis"),
        title: Cow::Borrowed("rate-independent hysteresis"),
        stage: Stage::Memory,
        acts,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&PARAMETERS),
        shows: Cow::Borrowed("two branches at equal R, at any slow rate"),
        separates: Cow::Borrowed(separates),
        source: Cow::Borrowed("0 to 4 % of the span; Prandtl-Ishlinskii"),
    }
}

static INFO: Info = info(
    Acts::Displacement,
    "z' = z + w (mean of three play operators of z - z), radii r/3, 2r/3, r",
    "minor loops at 0.01 Hz",
);

static INFO_OF_THE_PLATE: Info = info(
    Acts::Motion,
    "z' = z + w (mean of three play operators of z - z), radii r/3, 2r/3, r, z the plate's",
    "minor loops at 0.01 Hz of one actuator and of all four",
);

fn radius(p: &[f64], k: usize) -> f64 {
    p[1] * (k + 1) as f64 / 3.0
}

fn play(state: f64, input: f64, radius: f64) -> f64 {
    state.clamp(input - radius, input + radius)
}

static OTHERS: [&dyn Effect; 3] = [&OF_THE_PLATE, &friction::DAHL, &friction::BOUC_WEN];

impl Effect for Plays {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        let plays: f64 = (0..3).map(|k| play(state[k], x, radius(p, k))).sum();
        x + p[0] * (plays / 3.0 - x)
    }

    fn is_inverted(&self) -> bool {
        self.info.acts == Acts::Displacement
    }

    fn states(&self) -> usize {
        3
    }

    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        for (k, s) in state.iter_mut().enumerate() {
            *s = play(*s, step.to, radius(p, k));
        }
    }
}
