//! How well a mirror followed the positions that were asked of it.

use std::fmt;

use experiments::Signal;
use measurement::Row;
use serde::Serialize;

/// The lag is sought up to so much of a period, in so many steps; a mirror that comes later follows nothing.
const MOST_LAG: f64 = 0.5;
const LAG_STEPS: u32 = 200;
/// Lags that leave no more than so many times the least part of the error are as good: of a course that looks alike at several the least is meant.
const AS_GOOD: f64 = 1.1;
/// Where no lag leaves so many times the least part, as along a ramp, whose lag is an offset, none is told. A choice.
const WORSE: f64 = 2.0;
/// A span of less than this part of what was asked is told as not followed: 3 dB, where a bandwidth ends by convention.
const FOLLOWED: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What was asked of one axis and what was reached along a signal, in the axis' own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Followed {
    /// Lowest and highest value that was asked for.
    pub(super) asked: [f64; 2],
    /// Lowest and highest value that was reached.
    pub(super) reached: [f64; 2],
    /// Reached less asked, in the mean.
    pub(super) mean_error: f64,
    /// The same about its mean (root mean square).
    pub(super) rms_error: f64,
    /// How late the mirror was: the shift of what was asked that leaves the least part of the error (s); `None` where nothing moves, or none leaves hardly
    /// less than others.
    pub(super) lag_s: Option<f64>,
}

/// The same of the piston, as it is told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Following {
    asked_um: [f64; 2],
    reached_um: [f64; 2],
    mean_error_um: f64,
    rms_error_um: f64,
    lag_s: Option<f64>,
}

impl Followed {
    /// Of times (s) and what was reached at them, against what was `asked` of the time and repeats itself after `period_s`; `None`
    /// where nothing was read.
    pub(super) fn of(
        points: &[(f64, f64)],
        asked: impl Fn(f64) -> f64,
        period_s: f64,
    ) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let errors = |lag_s: f64, from_s: f64| {
            let since = points.iter().filter(move |(t_s, _)| *t_s >= from_s);
            mean_and_rms(since.map(|(t_s, reached)| reached - asked(t_s - lag_s)))
        };
        // Nothing was asked before the beginning, where a jump to the first value leaves most: a lag is held against none over the same points.
        let left = |lag_s: f64| {
            let without = errors(0.0, lag_s).1.max(f64::MIN_POSITIVE);
            errors(lag_s, lag_s).1 / without
        };
        let lags_s = (0..=LAG_STEPS)
            .map(|step| MOST_LAG * period_s * f64::from(step) / f64::from(LAG_STEPS));
        let left: Vec<(f64, f64)> = lags_s.map(|lag_s| (lag_s, left(lag_s))).collect();
        let (mean_error, rms_error) = errors(0.0, 0.0);
        let asked_range = range(points.iter().map(|(t_s, _)| asked(*t_s)));
        let moves = asked_range[0] < asked_range[1];
        Some(Self {
            asked: asked_range,
            reached: range(points.iter().map(|(_, reached)| *reached)),
            mean_error,
            rms_error,
            lag_s: moves.then(|| least(&left)).flatten(),
        })
    }
}

/// Of lags and the part of the error that they leave the one that is meant.
fn least(left: &[(f64, f64)]) -> Option<f64> {
    let [least, most] = range(left.iter().map(|(_, rms)| *rms));
    if most < WORSE * least {
        return None;
    }
    let is_lowest = |at: &usize| {
        let (_, rms) = left[*at];
        let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten();
        rms <= AS_GOOD * least
            && beside
                .filter_map(|at| left.get(at))
                .all(|(_, it)| rms <= *it)
    };
    (0..left.len()).find(is_lowest).map(|at| left[at].0)
}

/// The lowest and the highest.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

/// Whether a mirror that comes from one value to another goes hardly as far as it is asked to.
pub(super) fn falls_short(asked: [f64; 2], reached: [f64; 2]) -> bool {
    let span = |[low, high]: [f64; 2]| high - low;
    span(reached) < FOLLOWED * span(asked)
}

impl Following {
    /// Of the rows from `from_s` on, whose displacements were read as their ticks began, `tick_s` after they were asked for.
    pub(super) fn of(signal: &Signal, rows: &[Row], from_s: f64, tick_s: f64) -> Option<Self> {
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter(|row| row.t_s >= from_s)
            .filter_map(|row| Some((row.t_s - 0.5 * tick_s, row.z_um?)))
            .collect();
        let followed = Followed::of(&points, |t_s| signal.at(t_s), signal.period_s())?;
        Some(Self {
            asked_um: followed.asked,
            reached_um: followed.reached,
            mean_error_um: followed.mean_error,
            rms_error_um: followed.rms_error,
            lag_s: followed.lag_s,
        })
    }

    /// Whether the mirror went hardly as far as it was asked to.
    pub(super) fn falls_short(&self) -> bool {
        falls_short(self.asked_um, self.reached_um)
    }
}

/// The mean, and the root mean square about it; no numbers of nothing.
pub(super) fn mean_and_rms(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / count).sqrt())
}

impl fmt::Display for Following {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, what, [low, high]: [f64; 2]| {
            writeln!(f, "{what:<10} {low:.3} to {high:.3} um")
        };
        line(f, "asked", self.asked_um)?;
        line(f, "reached", self.reached_um)?;
        write!(
            f,
            "error      {:.3} um in the mean, {:.3} um rms about it",
            self.mean_error_um, self.rms_error_um
        )?;
        match self.lag_s {
            Some(lag_s) => writeln!(f, "; {:.2} ms late", 1e3 * lag_s),
            None => writeln!(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiments::Wave;
    use proptest::prelude::*;

    const TICK_S: f64 = 1e-4;
    /// A hundred a cycle.
    const ROWS: u32 = 300;

    /// A sine of 50 um about 100 um, as a mirror follows it.
    fn followed(
        frequency_hz: f64,
        z_um: impl Fn(&Signal, f64) -> Option<f64>,
    ) -> Option<Following> {
        let signal = Signal::Sine(Wave {
            mean: 100.0,
            amplitude: 50.0,
            frequency_hz,
        });
        let rows: Vec<Row> = (0..ROWS)
            .map(|index| {
                let t_s = f64::from(index) * 3.0 / frequency_hz / f64::from(ROWS);
                Row {
                    t_s,
                    z_um: z_um(&signal, t_s - 0.5 * TICK_S),
                    ..Row::default()
                }
            })
            .collect();
        // From half a row before the second cycle, so that rounding leaves none of its rows out.
        let from_s = (1.0 - 1.5 / f64::from(ROWS)) / frequency_hz;
        Following::of(&signal, &rows, from_s, TICK_S)
    }

    proptest! {
        #[test]
        fn an_offset_and_a_lag_are_found(
            frequency_hz in 0.1_f64..500.0, part in 0.0_f64..0.4, off_um in -5.0_f64..5.0,
        ) {
            let lag_s = part / frequency_hz;
            let late = |signal: &Signal, t_s: f64| Some(signal.at(t_s - lag_s) + off_um);
            let following = followed(frequency_hz, late).expect("it was read");
            // A row more or less, of two hundred, of a sine of 50 um near its middle.
            prop_assert!((following.mean_error_um - off_um).abs() < 0.1);
            // Two sines so far apart in phase: the chord between them, over the root of 2.
            let rms_um = 2.0_f64.sqrt() * 50.0 * (std::f64::consts::PI * part).sin();
            prop_assert!((following.rms_error_um - rms_um).abs() < 0.1, "{:?}", following);
            // Half a step of those that are tried.
            let found_s = following.lag_s.expect("a sine has turns");
            prop_assert!((found_s - lag_s).abs() * frequency_hz <= 0.5 * MOST_LAG / 200.0 + 1e-9);
            prop_assert!(!following.falls_short());
        }
    }

    #[test]
    fn a_ramp_tells_no_lag_and_what_repeats_itself_the_least() {
        let noise = |step: u32| 0.05 * (f64::from(step * 37 % 101) / 50.0 - 1.0);
        let points = |asked: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
            let steps = 100..1000;
            steps
                .map(|step| {
                    (
                        1e-3 * f64::from(step),
                        asked(1e-3 * f64::from(step)) + noise(step),
                    )
                })
                .collect()
        };
        let ramp = |t_s: f64| 80.0 + 20.0 * t_s;
        let followed = Followed::of(&points(&ramp), ramp, 1.0).expect("points");
        assert_eq!(followed.lag_s, None);
        // Ten sines of 0.1 s in a period of 1 s.
        let sines = |t_s: f64| 80.0 + 20.0 * (std::f64::consts::TAU * 10.0 * t_s).sin();
        let late = |t_s: f64| sines(t_s - 5e-3);
        let followed = Followed::of(&points(&late), sines, 1.0).expect("points");
        assert_eq!(followed.lag_s, Some(5e-3));
    }

    #[test]
    fn what_does_not_move_is_not_late_and_a_jump_to_the_first_value_is_no_lag() {
        let steps = (0..2000).map(|step| 5e-4 * f64::from(step) + 5e-5);
        // From 0 at rest to the first value in 3 ms, and from the last one back at the end.
        let course = |t_s: f64| 0.1 * t_s.rem_euclid(1.0);
        let reached = |t_s: f64| course(t_s) + 0.05 * (-t_s / 1e-3).exp();
        let points: Vec<(f64, f64)> = steps.map(|t_s| (t_s, reached(t_s))).collect();
        let at = |asked: &dyn Fn(f64) -> f64| {
            let followed = Followed::of(&points, asked, 1.0);
            followed.expect("points").lag_s
        };
        assert_eq!(at(&course), Some(0.0));
        assert_eq!(at(&|_| 0.0), None);
    }

    #[test]
    fn a_mirror_that_hardly_moves_falls_short() {
        let following = followed(2000.0, |_, _| Some(100.0)).expect("it was read");
        assert!(following.falls_short());
        assert_eq!(following.reached_um, [100.0, 100.0]);
        assert_eq!(followed(1.0, |_, _| None), None);
    }
}
