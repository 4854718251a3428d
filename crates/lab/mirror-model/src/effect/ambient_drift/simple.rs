//! Surroundings that drift in one simple way: a form each, with the two or three parameters that it takes.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

/// A course of the surroundings' temperature, at a time (K, s).
pub(super) struct Course {
    form: &'static str,
    info: &'static Info,
    rise_k: fn(&[f64], f64) -> f64,
}

/// A kilosecond (s).
const KS: f64 = 1e3;
/// A door that opens changes a room's air in some seconds (s).
const OPENING_S: f64 = 5.0;

pub(super) static SETTLING: Course = Course {
    form: "settling",
    info: &SETTLES,
    rise_k: |p, t_s| p[0] * -(-t_s / p[1]).exp_m1(),
};

pub(super) static RAMP: Course = Course {
    form: "ramp",
    info: &RAMPS,
    rise_k: |p, t_s| p[0] * t_s / KS,
};

pub(super) static STEP: Course = Course {
    form: "step",
    info: &STEPS,
    rise_k: |p, t_s| {
        let since = |t_s: f64| 0.5 * (1.0 + ((t_s - p[1]) / OPENING_S).tanh());
        p[0] * (since(t_s) - since(0.0))
    },
};

pub(super) static SWING: Course = Course {
    form: "periodic",
    info: &SWINGS,
    rise_k: |p, t_s| p[0] * ((TAU * t_s / p[1] + p[2]).sin() - p[2].sin()),
};

const fn info(equation: &'static str, source: &'static str, values: &'static [Parameter]) -> Info {
    Info {
        id: Cow::Borrowed("ambient-drift"),
        title: Cow::Borrowed("the surroundings drift"),
        stage: Stage::Heat,
        acts: Acts::Temperature,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(values),
        shows: Cow::Borrowed(
            "the same at every drive, follows the clock, also in the cold resistance",
        ),
        separates: Cow::Borrowed("the cold resistance, a thermometer"),
        source: Cow::Borrowed(source),
    }
}

// Of a session of minutes: rooms and carriers settle by some kelvins, within minutes to an hour; heating and air conditioning
// swing every one to twenty-five minutes, a stage that is held at a temperature every ten seconds and more.
static SETTLING_VALUES: [Parameter; 2] = [
    parameter("D", "K", 1.0, -15.0, 15.0),
    parameter("tau", "s", 200.0, 30.0, 3000.0),
];
static SETTLES: Info = info(
    "dT' = dT + D (1 - exp(-t/tau))",
    "Newton's law of cooling of a room or carrier; 1.8 um/K",
    &SETTLING_VALUES,
);
static RAMP_VALUES: [Parameter; 1] = [parameter("g", "K/ks", 3.0, -50.0, 50.0)];
static RAMPS: Info = info(
    "dT' = dT + g t",
    "the begin of a settling that takes much longer than the session; 1.8 um/K",
    &RAMP_VALUES,
);
static STEP_VALUES: [Parameter; 2] = [
    parameter("D", "K", 0.5, -15.0, 15.0),
    parameter("t_0", "s", 150.0, 10.0, 2000.0),
];
static STEPS: Info = info(
    "dT' = dT + D (1 + tanh((t - t_0)/5 s))/2",
    "a door or a window; 1.8 um/K",
    &STEP_VALUES,
);
static SWING_VALUES: [Parameter; 3] = [
    parameter("D", "K", 0.2, -5.0, 5.0),
    parameter("T", "s", 200.0, 10.0, 1500.0),
    parameter("p", "rad", 1.0, -PI, PI),
];
static SWINGS: Info = info(
    "dT' = dT + D (sin(2 pi t/T + p) - sin p)",
    "a thermostat that switches, a stage's own controller; 1.8 um/K",
    &SWING_VALUES,
);

impl Effect for Course {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn is_of_time(&self) -> bool {
        true
    }

    fn is_periodic(&self) -> bool {
        self.form == SWING.form
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x + (self.rise_k)(p, m.t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn courses_begin_at_nothing_and_come_to_what_they_say() {
        let at = |course: &Course, values: &[f64], t_s: f64| {
            let moment = Moment {
                t_s,
                ..Moment::default()
            };
            course.output(values, 10.0, &[], &moment) - 10.0
        };
        for course in [&SETTLING, &RAMP, &STEP, &SWING] {
            let usual: Vec<f64> = course.info.parameters.iter().map(|p| p.start).collect();
            assert!(at(course, &usual, 0.0).abs() < 1e-12, "{}", course.form);
        }
        // 1 - 1/e of 2 K after a time constant; 3 K a kilosecond; half of 2 K at the step; a quarter of a period, from 0 and from
        // the top on.
        let e = std::f64::consts::E;
        assert!((at(&SETTLING, &[2.0, 300.0], 300.0) - 2.0 * (1.0 - 1.0 / e)).abs() < 1e-12);
        assert!((at(&RAMP, &[3.0], 500.0) - 1.5).abs() < 1e-12);
        assert!((at(&STEP, &[2.0, 100.0], 100.0) - 1.0).abs() < 1e-12);
        assert!((at(&STEP, &[2.0, 100.0], 200.0) - 2.0).abs() < 1e-12);
        assert!((at(&SWING, &[0.2, 200.0, 0.0], 50.0) - 0.2).abs() < 1e-12);
        assert!((at(&SWING, &[0.2, 200.0, 0.5 * PI], 50.0) + 0.2).abs() < 1e-12);
    }
}
