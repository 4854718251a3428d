//! Heat from other actuators that arrives behind their power, by a way of its own: a form each.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

/// A way, and the power at its other end (W).
pub(super) struct Way {
    form: &'static str,
    info: &'static Info,
    power_w: fn(&Moment) -> f64,
}

pub(super) static FRAME: Way = Way {
    form: "frame",
    info: &THROUGH_THE_FRAME,
    power_w: |m| m.total_power_w - m.power_w,
};

pub(super) static NEIGHBOURS: Way = Way {
    form: "neighbours",
    info: &BETWEEN_NEIGHBOURS,
    power_w: |m| m.total_power_w - m.power_w - m.opposite_power_w,
};

pub(super) static PLATE: Way = Way {
    form: "plate",
    info: &ACROSS_THE_PLATE,
    power_w: |m| m.opposite_power_w,
};

// Of the power of each actuator at the other end; at most three times the 10 % of the source. Beams follow in milliseconds, a
// frame of silicon in tenths of a second, and the package, which is slower, is the substrate's warming.
static PARAMETERS: [Parameter; 2] = [
    parameter("k", "1", 0.02, 0.0, 0.3),
    parameter("tau", "s", 0.01, 1e-3, 0.5),
];

const fn info(equation: &'static str, source: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("crosstalk"),
        title: Cow::Borrowed("heat from the other actuators"),
        stage: Stage::Heat,
        acts: Acts::Heating,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&PARAMETERS),
        shows: Cow::Borrowed(
            "an actuator's misfit follows the power of the others, and comes behind it",
        ),
        separates: Cow::Borrowed("heat one actuator and sense each idle one"),
        source: Cow::Borrowed(source),
    }
}

static THROUGH_THE_FRAME: Info = info(
    "R_T P_i' = R_T P_i + k s; tau ds/dt = R_T (the other three P_j) - s",
    "1 to 10 % through a frame that all four stand on: one heat capacity, the same for all (Incropera and DeWitt, section 5.1)",
);
static BETWEEN_NEIGHBOURS: Info = info(
    "R_T P_i' = R_T P_i + k s; tau ds/dt = R_T (both neighbours' P_j) - s",
    "1 to 10 % through the air between beams that lie side by side",
);
static ACROSS_THE_PLATE: Info = info(
    "R_T P_i' = R_T P_i + k s; tau ds/dt = R_T (the opposite P_j) - s",
    "along a bar or a plate that joins two opposite actuators",
);

impl Effect for Way {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn looks_at_other_actuators(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], m: &Moment) -> f64 {
        let goal_k = m.thermal_resistance_k_per_w * (self.power_w)(m);
        x + p[0] * m.lagged(state[0], p[1], state[1], goal_k)
    }

    fn states(&self) -> usize {
        2
    }

    /// The states are the rise that arrives, and what the power at the other end would make of it, at the end of the last step.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let m = &step.moment;
        let (from, to) = (state[1], m.thermal_resistance_k_per_w * (self.power_w)(m));
        state[0] = Step { from, to, ..*step }.relax(state[0], p[1]);
        state[1] = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first of four actuators at 1, 2, 4 and 8 mW around the mirror: 2 and 8 mW are its neighbours', 4 mW is opposite.
    const MOMENT: Moment = Moment {
        t_s: 0.0,
        voltage_v: 0.0,
        mean_square_v2: 0.0,
        resistance_ohm: 0.0,
        cold_resistance_ohm: 0.0,
        grown_resistance_ohm: 0.0,
        power_w: 1e-3,
        total_power_w: 15e-3,
        others_current_a: 0.0,
        opposite_power_w: 4e-3,
        thermal_resistance_k_per_w: 1e4,
        temperature_rise_k: 0.0,
        ambient_k: 0.0,
        curvature_per_k: 0.0,
        z_um: 0.0,
        step_s: 0.0,
    };

    #[test]
    fn what_arrives_follows_the_powers_at_the_other_end() {
        for (way, rise_k) in [(&FRAME, 140.0), (&NEIGHBOURS, 100.0), (&PLATE, 40.0)] {
            let parameters = [0.1, 0.02];
            // The powers have been on.
            let mut state = [0.0, rise_k];
            let step = Step {
                from: 0.0,
                to: 0.0,
                duration_s: 0.02,
                moment: MOMENT,
            };
            way.advance(&parameters, &mut state, &step);
            let arrived = 0.1 * rise_k * (1.0 - (-1.0_f64).exp());
            let found = way.output(&parameters, 5.0, &state, &MOMENT) - 5.0;
            assert!((found - arrived).abs() < 1e-9, "{} {found}", way.form);
        }
    }
}
