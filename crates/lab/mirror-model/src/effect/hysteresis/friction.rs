//! Friction whose loops have rounded corners: what is held back follows the way that was gone since the last turn.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

/// A law of how the part `h` of the whole friction, -1 to 1, grows with the way.
pub(super) struct Friction {
    form: &'static str,
    info: &'static Info,
    /// The part after a way (in lengths) along the sense in which it counts, from a part at its begin.
    after: fn(f64, f64) -> f64,
}

/// P. Dahl, A Solid Friction Model (Aerospace Corporation, 1968), exponent 1.
pub(super) static DAHL: Friction = Friction {
    form: "dahl",
    info: &OF_DAHL,
    after: |part, way| 1.0 + (part - 1.0) * (-way).exp(),
};

/// Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249, with n = 2 and equal shares of both terms: on the way back the friction is
/// taken off in a straight line, and then grows as a hyperbolic tangent.
pub(super) static BOUC_WEN: Friction = Friction {
    form: "bouc-wen",
    info: &OF_BOUC_AND_WEN,
    after: |part, way| {
        let unloaded = part + way;
        if unloaded <= 0.0 {
            unloaded
        } else if part < 0.0 {
            unloaded.tanh()
        } else {
            (part.atanh() + way).tanh()
        }
    },
};

// The paper's loop at 0.1 Hz is 1.6 um high, which is twice a; 6 um are 3.5 % of its 173.7 um either way. L as the plays' radius: a
// turn is over within a part of the stroke, here a fourteenth.
static PARAMETERS: [Parameter; 2] = [
    parameter("a", "um", 0.8, 0.0, 6.0),
    parameter("L", "um", 12.0, 1.0, 60.0),
];

const fn info(equation: &'static str, source: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("hysteresis"),
        title: Cow::Borrowed("rate-independent hysteresis"),
        stage: Stage::Memory,
        acts: Acts::Displacement,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&PARAMETERS),
        shows: Cow::Borrowed("two branches at equal R, at any slow rate, with rounded corners"),
        separates: Cow::Borrowed("minor loops at 0.01 Hz"),
        source: Cow::Borrowed(source),
    }
}

static OF_DAHL: Info = info(
    "z' = z - a h; L dh = |dz| (sign(dz) - h)",
    "dry internal friction (Dahl 1968)",
);
static OF_BOUC_AND_WEN: Info = info(
    "z' = z - a h; L dh = dz (1 - h^2 where dz h > 0)",
    "Bouc-Wen, n = 2, beta = gamma (Wen 1976)",
);

impl Friction {
    /// The part of the friction after the way from one displacement to another.
    fn turned(&self, part: f64, from_um: f64, to_um: f64, length_um: f64) -> f64 {
        let sense = (to_um - from_um).signum();
        let way = (to_um - from_um).abs() / length_um;
        sense * (self.after)(sense * part, way)
    }
}

impl Effect for Friction {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x - p[0] * self.turned(state[0], state[1], x, p[1])
    }

    fn states(&self) -> usize {
        2
    }

    /// The states are the part of the friction, and where the way went on to.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        state[0] = self.turned(state[0], state[1], step.to, p[1]);
        state[1] = step.to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH_UM: f64 = 10.0;

    /// What is held back along a way (um) through these turns, in so many steps each.
    fn held_back_um(law: &Friction, turns: &[f64], steps: u32) -> f64 {
        let parameters = [2.0, LENGTH_UM];
        let mut state = [0.0, 0.0];
        let mut at = 0.0;
        for &turn in turns {
            let begin = at;
            for step in 1..=steps {
                let to = begin + (turn - begin) * f64::from(step) / f64::from(steps);
                let step = Step {
                    from: at,
                    to,
                    duration_s: 1.0,
                    moment: Moment::default(),
                };
                law.advance(&parameters, &mut state, &step);
                at = to;
            }
        }
        at - law.output(&parameters, at, &state, &Moment::default())
    }

    #[test]
    fn a_way_of_any_number_of_steps_is_the_closed_form() {
        for steps in [1, 7] {
            // Dahl from rest: a (1 - e^-x); and back by y: -a + (h + a) e^-y.
            let up = 2.0 * (1.0 - (-3.0_f64).exp());
            let back = -2.0 + (up + 2.0) * (-1.5_f64).exp();
            let found = held_back_um(&DAHL, &[30.0, 15.0], steps);
            assert!((found - back).abs() < 1e-12, "{found}");
            // Bouc-Wen from rest: a tanh(x); back in a straight line to 0, then a tanh of the rest of the way.
            let part = 2.0_f64.tanh();
            let found = held_back_um(&BOUC_WEN, &[20.0, 15.0], steps);
            assert!((found - 2.0 * (part - 0.5)).abs() < 1e-12, "{found}");
            let found = held_back_um(&BOUC_WEN, &[20.0, 0.0], steps);
            assert!((found + 2.0 * (2.0 - part).tanh()).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn nothing_moves_nothing() {
        for law in [&DAHL, &BOUC_WEN] {
            let part = law.turned(0.4, 5.0, 5.0, LENGTH_UM);
            assert!((part - 0.4).abs() < 1e-15, "{} {part}", law.form);
        }
    }
}
