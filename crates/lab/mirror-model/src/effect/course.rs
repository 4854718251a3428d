//! What follows the clock in one simple way: a form each, with the one to three parameters that it takes. Surroundings drift so, and a
//! sensor's zero.

use super::{Acts, Effect, Info, Moment, Stage, Timing, parameter};
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

/// An effect that adds a course of its own to what it acts on.
pub(super) struct Course {
    pub(super) form: &'static str,
    pub(super) info: &'static Info,
    /// What is added, at a time (s).
    pub(super) added: fn(&[f64], f64) -> f64,
    pub(super) timing: Option<Timing>,
    /// Its other forms, of the first one.
    pub(super) others: &'static [&'static dyn Effect],
}

/// A kilosecond (s).
const KS: f64 = 1e3;

/// Towards `p[0]`, with the time constant `p[1]` (s).
pub(super) fn settling(p: &[f64], t_s: f64) -> f64 {
    p[0] * -(-t_s / p[1]).exp_m1()
}

/// By `p[0]` in a kilosecond.
pub(super) fn ramp(p: &[f64], t_s: f64) -> f64 {
    p[0] * t_s / KS
}

/// By `p[0]` at `p[1]` (s), within some `lasts_s`.
pub(super) fn step(p: &[f64], t_s: f64, lasts_s: f64) -> f64 {
    let since = |t_s: f64| 0.5 * (1.0 + ((t_s - p[1]) / lasts_s).tanh());
    p[0] * (since(t_s) - since(0.0))
}

/// To and fro by `p[0]`, with the period `p[1]` (s), from the phase `p[2]` (rad) on.
pub(super) fn swing(p: &[f64], t_s: f64) -> f64 {
    p[0] * ((TAU * t_s / p[1] + p[2]).sin() - p[2].sin())
}

/// As much as its strength more, from the begin on.
struct Constant(Info);

/// An effect that adds as much as its strength to the quantity that it acts on, from just after the begin on: displacements count from there.
pub fn constant(acts: Acts) -> Arc<dyn Effect> {
    let text = || Cow::Borrowed("a constant");
    Arc::new(Constant(Info {
        id: text(),
        title: text(),
        stage: Stage::Sensor,
        acts,
        equation: Cow::Borrowed("x' = x + c"),
        parameters: Cow::Owned(vec![parameter("c", "1", 1.0, 0.0, 1.0)]),
        shows: text(),
        separates: text(),
        source: text(),
    }))
}

impl Effect for Constant {
    fn info(&self) -> &Info {
        &self.0
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        if m.t_s > 0.0 { x + p[0] } else { x }
    }
}

impl Effect for Course {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        self.others
    }

    fn is_of_time(&self) -> bool {
        true
    }

    fn timing(&self) -> Option<Timing> {
        self.timing
    }

    fn is_course(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x + (self.added)(p, m.t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{E, PI};

    #[test]
    fn courses_begin_at_nothing_and_come_to_what_they_say() {
        for at_once in [
            settling(&[2.0, 300.0], 0.0),
            ramp(&[3.0], 0.0),
            step(&[2.0, 100.0], 0.0, 5.0),
            swing(&[0.2, 200.0, 1.0], 0.0),
        ] {
            assert_eq!(at_once, 0.0);
        }
        // 1 - 1/e of 2 K after a time constant; 3 K a kilosecond; half of 2 K at the step; a quarter of a period, from 0 and from
        // the top on.
        assert!((settling(&[2.0, 300.0], 300.0) - 2.0 * (1.0 - 1.0 / E)).abs() < 1e-12);
        assert!((ramp(&[3.0], 500.0) - 1.5).abs() < 1e-12);
        assert!((step(&[2.0, 100.0], 100.0, 5.0) - 1.0).abs() < 1e-12);
        assert!((step(&[2.0, 100.0], 200.0, 5.0) - 2.0).abs() < 1e-12);
        assert!((swing(&[0.2, 200.0, 0.0], 50.0) - 0.2).abs() < 1e-12);
        assert!((swing(&[0.2, 200.0, 0.5 * PI], 50.0) + 0.2).abs() < 1e-12);
    }
}
