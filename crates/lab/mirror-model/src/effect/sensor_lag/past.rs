//! Sensors that read the past as it was: an exposure that is averaged, and a reading that is told later.

use crate::effect::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

/// The longest (s): a meter that averages over fifteen periods of 50 Hz mains, a choice; slower readings are taken one by one, and
/// nobody would step a drive faster.
pub(super) const LONGEST_S: f64 = 0.3;
pub(super) const SHOWS: Cow<'static, str> =
    Cow::Borrowed("z is late whatever moves it, R is not; more at higher frequency");
pub(super) const SEPARATES: Cow<'static, str> =
    Cow::Borrowed("a reference step of a stage of known speed");

/// A sensor whose reading is how far behind what it measures, of the last `tau` (um, s).
pub(super) struct Past {
    form: &'static str,
    info: &'static Info,
    behind: fn(&[f64], f64) -> f64,
}

pub(super) static AVERAGE: Past = Past {
    form: "average",
    info: &AVERAGES,
    behind: |history, tau_s| behind(history, tau_s).averaged,
};

pub(super) static DELAY: Past = Past {
    form: "delay",
    info: &DELAYS,
    behind: |history, tau_s| behind(history, tau_s).delayed,
};

const fn info(equation: &'static str, source: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("sensor-lag"),
        title: Cow::Borrowed("lag of the sensor"),
        stage: Stage::Sensor,
        acts: Acts::Reading,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&VALUES),
        shows: SHOWS,
        separates: SEPARATES,
        source: Cow::Borrowed(source),
    }
}

static VALUES: [Parameter; 1] = [parameter("tau", "s", 1e-3, 0.0, LONGEST_S)];
static AVERAGES: Info = info(
    "y = mean of z over the last tau",
    "an exposure, or a number of samples that are averaged",
);
static DELAYS: Info = info(
    "y(t) = z(t - tau)",
    "readings that are computed and sent before they are told",
);

impl Effect for Past {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn output(&self, p: &[f64], x: f64, history: &[f64], _: &Moment) -> f64 {
        x - (self.behind)(history, p[0])
    }

    fn states(&self) -> usize {
        2 * STRETCHES
    }

    fn advance(&self, p: &[f64], history: &mut [f64], step: &Step) {
        // A straight stretch goes on until it is a fair part of what is looked back on, so that all stretches reach so far.
        if history[0] >= p[0] / REACHING {
            history.copy_within(..2 * STRETCHES - 2, 2);
            history[..2].fill(0.0);
        }
        history[0] += step.duration_s;
        history[1] += step.to - step.from;
    }
}

/// The displacement's past in straight stretches, the newest first: how long each is, and how far it goes (s, um). A
/// fortieth of what is looked back on is as fine as it has to be: a mirror that follows as fast bends by a thousandth of a
/// step within it.
const STRETCHES: usize = 42;
/// So many of them are as long as what is looked back on: all but the newest, which grows, and the oldest, which may be cut.
const REACHING: f64 = (STRETCHES - 2) as f64;
/// What is shorter is no time (s).
const AT_ONCE_S: f64 = 1e-9;

/// How far a reading is behind (um).
struct Behind {
    /// One that was taken a while ago.
    delayed: f64,
    /// One that is averaged over that while.
    averaged: f64,
}

/// Of the last `tau_s` (s). What was before the history stood still.
fn behind(history: &[f64], tau_s: f64) -> Behind {
    let mut left_s = tau_s;
    let (mut delayed, mut area) = (0.0, 0.0);
    for stretch in history.chunks_exact(2) {
        let (lasts_s, goes) = (stretch[0], stretch[1]);
        let within_s = lasts_s.min(left_s);
        if within_s <= 0.0 {
            break;
        }
        let moved = goes * within_s / lasts_s;
        area += within_s * (delayed + 0.5 * moved);
        delayed += moved;
        left_s -= within_s;
    }
    area += left_s * delayed;
    Behind {
        delayed,
        averaged: if tau_s > AT_ONCE_S { area / tau_s } else { 0.0 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What a sensor reads at the end of steps (s) of an input that is a function of time.
    fn read(sensor: &Past, tau_s: f64, steps_s: &[f64], input: impl Fn(f64) -> f64) -> f64 {
        let mut history = vec![0.0; sensor.states()];
        let mut t_s = 0.0;
        for &duration_s in steps_s {
            let step = Step {
                from: input(t_s),
                to: input(t_s + duration_s),
                duration_s,
                moment: Moment::default(),
            };
            sensor.advance(&[tau_s], &mut history, &step);
            t_s += duration_s;
        }
        sensor.output(&[tau_s], input(t_s), &history, &Moment::default())
    }

    #[test]
    fn a_delay_is_behind_by_all_of_it_and_an_average_by_half() {
        // A ramp of 100 um/s for 10 ms, read over 2 ms, in steps of all lengths.
        for steps in [1, 3, 10, 97, 1000] {
            let steps_s = vec![1e-2 / f64::from(steps); steps as usize];
            let read = |sensor| read(sensor, 2e-3, &steps_s, |t_s| 100.0 * t_s);
            assert!((read(&DELAY) - 0.8).abs() < 1e-9, "{steps}");
            assert!((read(&AVERAGE) - 0.9).abs() < 1e-9, "{steps}");
        }
        // At once, before anything moved, and long after.
        assert_eq!(read(&DELAY, 0.0, &[0.1; 3], f64::exp), 0.3f64.exp());
        assert_eq!(read(&AVERAGE, 0.0, &[0.1; 3], f64::exp), 0.3f64.exp());
        assert_eq!(read(&AVERAGE, 1.0, &[0.1; 3], |_| 5.0), 5.0);
    }

    #[test]
    fn a_mirror_as_fast_as_the_sensor_is_read_to_a_thousandth_of_its_step() {
        let (tau_s, step_s) = (1e-3, 1e-5);
        let rise = |t_s: f64| -100.0 * (-t_s / 1e-3).exp_m1();
        for steps in [20, 99, 150, 400] {
            let t_s = f64::from(steps) * step_s;
            let delayed = rise((t_s - tau_s).max(0.0));
            // The integral of the rise from when it began.
            let area = |t_s: f64| 100.0 * (t_s + 1e-3 * (-t_s / 1e-3).exp_m1());
            let averaged = (area(t_s) - area((t_s - tau_s).max(0.0))) / tau_s;
            let steps_s = vec![step_s; steps as usize];
            assert!((read(&DELAY, tau_s, &steps_s, rise) - delayed).abs() < 0.1);
            assert!((read(&AVERAGE, tau_s, &steps_s, rise) - averaged).abs() < 0.1);
        }
    }

    proptest! {
        #[test]
        fn a_reading_lies_within_what_there_was(
            steps_s in prop::collection::vec(1e-6..1.0f64, 1..200),
            tau_s in 0.0..0.3f64,
        ) {
            for sensor in [&AVERAGE, &DELAY] {
                let reading = read(sensor, tau_s, &steps_s, |t_s| (7.0 * t_s).sin());
                prop_assert!(reading.abs() <= 1.0 + 1e-9);
            }
        }
    }
}
