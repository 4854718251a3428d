//! How well a board positions: at rest, after a step, and along sines and a triangle.

use experiments::Experiment;
use experiments::calibration::{self as played, Effort};
use measurement::{MeasurementFile, Row};
use serde::{Deserialize, Serialize};

use crate::bench::{Bench, Part};

/// A step has arrived where it stays within this part of it.
const ARRIVED: f64 = 0.05;

/// A drive so near to the highest is at it (V): two codes, between which it is dithered.
const DRIVE_STEP_V: f64 = 2e-3;

/// One reading of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Since the experiment's start (s).
    pub t_s: f64,
    /// Where the mirror was to be (um).
    pub asked_um: f64,
    /// Where it was (um).
    pub reached_um: f64,
}

/// What was asked and reached in one experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The readings, in the order of time.
    pub points: Vec<Point>,
}

/// What a board reached of what it was asked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Positions at rest, but for those at which a drive was at its highest: what is not reached there is the board's limit, and says
    /// nothing of the calibration.
    pub rest: Series,
    /// How many those were.
    #[serde(default)]
    pub rests_at_the_highest_drive: usize,
    /// A step upwards; its times count from the step.
    pub step: Series,
    /// Where the step begins (um).
    pub step_from_um: f64,
    /// A sine of 1 Hz after its first cycle, which begins with a jump from rest.
    pub slow_sine: Series,
    /// A sine of 20 Hz, the same.
    pub fast_sine: Series,
    /// A triangle of 20 Hz, the same.
    pub triangle: Series,
}

/// A trial in numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    /// Error at rest (um, root mean square).
    pub rest_rms_um: f64,
    /// Error at rest, the largest (um).
    pub rest_largest_um: f64,
    /// Positions at rest that the highest drive did not reach, which do not count.
    pub rests_at_the_highest_drive: usize,
    /// Until z stays within 5 % of the step (ms).
    pub t95_ms: f64,
    /// Beyond the target, in per cent of the step.
    pub overshoot_percent: f64,
    /// Largest distance between the two ways of the sine of 1 Hz (um).
    pub slow_loop_um: f64,
    /// The same of the sine of 20 Hz (um).
    pub loop_um: f64,
    /// From the bottom to the top of the triangle of 20 Hz (um).
    pub triangle_um: f64,
    /// Error along it (um, root mean square).
    pub triangle_rms_um: f64,
}

impl Point {
    /// Reached less asked (um).
    pub fn error_um(&self) -> f64 {
        self.reached_um - self.asked_um
    }
}

impl Series {
    /// Plays an experiment of positions.
    pub(crate) async fn measure<B: Bench>(
        bench: &mut B,
        part: Part,
        experiment: &Experiment,
    ) -> Result<Self, B::Error> {
        let file = bench.measure(part, experiment).await?;
        Ok(Self::of(&file, experiment, bench.tick_s()))
    }

    /// What a file says of an experiment of positions.
    fn of(file: &MeasurementFile, experiment: &Experiment, tick_s: f64) -> Self {
        let signal = experiment.runs.first().map(|run| &run.signal);
        // A row is read as its tick begins: where the tick before was asked to end.
        let since_s = 0.5 * tick_s;
        let points = file
            .rows
            .iter()
            .filter(|row| row.t_s > since_s)
            .filter_map(|row| {
                Some(Point {
                    t_s: row.t_s,
                    asked_um: signal?.at(row.t_s - since_s),
                    reached_um: row.z_um?,
                })
            })
            .collect();
        Self { points }
    }

    /// The part of it later than so long after its start (s), which its times count from.
    fn after(mut self, start_s: f64) -> Self {
        self.points.retain(|point| point.t_s > start_s);
        self.points
            .iter_mut()
            .for_each(|point| point.t_s -= start_s);
        self
    }

    fn errors_um(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(Point::error_um)
    }

    fn rms_um(&self) -> f64 {
        let squares: f64 = self.errors_um().map(|error| error * error).sum();
        (squares / self.points.len().max(1) as f64).sqrt()
    }

    fn largest_um(&self) -> f64 {
        self.errors_um().map(f64::abs).fold(0.0, f64::max)
    }

    /// The mean of what was reached in the last quarter of the time (um).
    fn end_um(&self) -> f64 {
        let from_s = 0.75 * self.points.last().map_or(0.0, |point| point.t_s);
        let late = || self.points.iter().filter(|point| point.t_s >= from_s);
        late().map(|point| point.reached_um).sum::<f64>() / late().count().max(1) as f64
    }

    /// Lowest and highest position that was asked for (um).
    fn asked_range_um(&self) -> (f64, f64) {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        self.points.iter().fold(none, |(low, high), point| {
            (low.min(point.asked_um), high.max(point.asked_um))
        })
    }

    /// Largest distance between the way up and the way down at the same asked position (um).
    fn loop_um(&self) -> f64 {
        /// Parts of the range in which the errors of each way are averaged. The two ways of an ellipse are as far apart, to
        /// 0.3 ppt, all over one in the middle.
        const BINS: usize = 40;
        let (low, high) = self.asked_range_um();
        // Sum and count of the errors, on the way down and up.
        let mut ways = [[(0.0, 0.0); BINS]; 2];
        for pair in self.points.windows(2) {
            let (before, point) = (pair[0], pair[1]);
            let way = usize::from(point.asked_um > before.asked_um);
            let bin = ((point.asked_um - low) / (high - low) * BINS as f64) as usize;
            let (sum, count) = &mut ways[way][bin.min(BINS - 1)];
            *sum += point.error_um();
            *count += 1.0;
        }
        let mean = |way: usize, bin: usize| {
            let (sum, count) = ways[way][bin];
            (count > 0.0).then(|| sum / count)
        };
        // In the tenth next to a turn one part holds readings from before the turn and after it.
        (BINS / 10..BINS - BINS / 10)
            .filter_map(|bin| Some((mean(1, bin)? - mean(0, bin)?).abs()))
            .fold(0.0, f64::max)
    }
}

impl Trial {
    /// Tries the calibration in use up to `top_um` on a board that drives up to `max_v`.
    pub(crate) async fn run<B: Bench>(
        bench: &mut B,
        part: Part,
        effort: &Effort,
        (top_um, max_v): (f64, f64),
    ) -> Result<Self, B::Error> {
        let played = played::Trial::new(effort, top_um);
        let period_s = |experiment: &Experiment| experiment.runs[0].signal.period_s();
        let rests = bench.measure(part, &played.rest).await?;
        let (rest, rests_at_the_highest_drive) =
            at_rest(rests, max_v, &played.rest, bench.tick_s());
        let step = Series::measure(bench, part, &played.step).await?;
        let step_from_um = played.step.runs[0].signal.at(0.0);
        let mut after_a_cycle = Vec::new();
        for experiment in [&played.slow_sine, &played.fast_sine, &played.triangle] {
            let series = Series::measure(bench, part, experiment).await?;
            after_a_cycle.push(series.after(period_s(experiment)));
        }
        let [slow_sine, fast_sine, triangle] =
            <[Series; 3]>::try_from(after_a_cycle).expect("three were played");
        Ok(Self {
            rest,
            rests_at_the_highest_drive,
            step: step.after(effort.hold_s),
            step_from_um,
            slow_sine,
            fast_sine,
            triangle,
        })
    }

    /// Its five series.
    pub fn series(&self) -> [&Series; 5] {
        let Self {
            rest,
            step,
            slow_sine,
            fast_sine,
            triangle,
            ..
        } = self;
        [rest, step, slow_sine, fast_sine, triangle]
    }

    /// The trial in numbers.
    pub fn figures(&self) -> Figures {
        let (time_s, overshoot) = self.arrival();
        let (low_um, high_um) = self.triangle.asked_range_um();
        Figures {
            rest_rms_um: self.rest.rms_um(),
            rest_largest_um: self.rest.largest_um(),
            rests_at_the_highest_drive: self.rests_at_the_highest_drive,
            t95_ms: 1e3 * time_s,
            overshoot_percent: 100.0 * overshoot,
            slow_loop_um: self.slow_sine.loop_um(),
            loop_um: self.fast_sine.loop_um(),
            triangle_um: high_um - low_um,
            triangle_rms_um: self.triangle.rms_um(),
        }
    }

    /// When the step has arrived (s), and how far beyond its end it went, as a part of it. What it comes to in the end is the
    /// position table's matter, not the step's.
    fn arrival(&self) -> (f64, f64) {
        let (end_um, points) = (self.step.end_um(), &self.step.points);
        let size_um = end_um - self.step_from_um;
        let is_there =
            |point: &&Point| (point.reached_um - end_um).abs() <= ARRIVED * size_um.abs();
        let arrived = points.iter().rev().take_while(is_there).last();
        let highest_um = points.iter().map(|point| point.reached_um);
        let beyond_um = highest_um.fold(f64::MIN, f64::max) - end_um;
        (
            arrived.map_or(f64::NAN, |point| point.t_s),
            beyond_um.max(0.0) / size_um.abs(),
        )
    }
}

/// What was reached at rest, without the positions that the highest drive did not reach, and how many those were. Under a calibration
/// of which they are the most it is the calibration's doing, and they count.
fn at_rest(
    mut rests: MeasurementFile,
    max_v: f64,
    experiment: &Experiment,
    tick_s: f64,
) -> (Series, usize) {
    let all = Series::of(&rests, experiment, tick_s);
    let at_the_highest = |row: &Row| row.voltage_v.iter().any(|v| *v > max_v - DRIVE_STEP_V);
    rests.rows.retain(|row| !at_the_highest(row));
    let mut reached = Series::of(&rests, experiment, tick_s);
    let missing = all.points.len() - reached.points.len();
    if missing > reached.points.len() {
        return (all, 0);
    }
    // What is beyond where it should be was not kept from it.
    let beyond = |point: &&Point| point.error_um() > 0.0 && !reached.points.contains(point);
    let beyond: Vec<Point> = all.points.iter().filter(beyond).copied().collect();
    let missing = missing - beyond.len();
    reached.points.extend(beyond);
    (reached, missing)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mirror 0.1 um short everywhere, and 5 um where the drive is at its highest.
    #[test]
    fn what_the_highest_drive_does_not_reach_says_nothing_of_a_calibration() {
        let positions = [40.0, 160.0, 80.0, 120.0];
        let experiment = Experiment::positions("rest", &positions, 1.0);
        let file = |highest: &[usize]| MeasurementFile {
            rows: positions
                .iter()
                .enumerate()
                .map(|(index, um)| Row {
                    t_s: index as f64 + 0.99,
                    voltage_v: [if highest.contains(&index) { 3.5 } else { 2.0 }; 4],
                    z_um: Some(um - if highest.contains(&index) { 5.0 } else { 0.1 }),
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        };
        let left = |highest: &[usize]| {
            let (series, missing) = at_rest(file(highest), 3.5, &experiment, 1e-4);
            (series.largest_um(), missing)
        };
        let (largest_um, missing) = left(&[1]);
        assert!(
            (largest_um - 0.1).abs() < 1e-9 && missing == 1,
            "{largest_um}"
        );
        // A calibration that asks for the highest drive nearly everywhere.
        let (largest_um, missing) = left(&[0, 1, 3]);
        assert!(
            (largest_um - 5.0).abs() < 1e-9 && missing == 0,
            "{largest_um}"
        );
    }

    fn series(points: impl IntoIterator<Item = (f64, f64, f64)>) -> Series {
        let point = |(t_s, asked_um, reached_um)| Point {
            t_s,
            asked_um,
            reached_um,
        };
        Series {
            points: points.into_iter().map(point).collect(),
        }
    }

    #[test]
    fn figures_are_those_of_a_known_step_and_loop() {
        let lag = |t: f64| 20.0 + 80.0 * (1.0 - (-t / 0.1).exp());
        let step = (0..3000).map(|i| f64::from(i) * 1e-3);
        let turn = |i: u32| f64::from(i) * 0.01;
        let sine = (0..1257).map(|i| {
            let (asked, reached) = (30.0 * turn(i).sin(), 30.0 * (turn(i) - 0.05).sin());
            (turn(i), asked, reached)
        });
        let trial = Trial {
            rest: series([(1.0, 10.0, 10.3), (2.0, 20.0, 19.6)]),
            rests_at_the_highest_drive: 0,
            step: series(step.map(|t| (t, 100.0, lag(t)))),
            step_from_um: 20.0,
            slow_sine: series([(1.0, 1.0, 1.0), (2.0, 2.0, 2.0), (3.0, 3.0, 3.0)]),
            fast_sine: series(sine),
            triangle: series([(1.0, 40.0, 40.3), (2.0, 60.0, 59.6)]),
        };
        let figures = trial.figures();
        // sqrt((0.3^2 + 0.4^2) / 2), to rounding.
        assert!((figures.rest_rms_um - 0.125_f64.sqrt()).abs() < 1e-9);
        assert!((figures.triangle_rms_um - 0.125_f64.sqrt()).abs() < 1e-9);
        assert!((figures.rest_largest_um - 0.4).abs() < 1e-9);
        assert!((figures.triangle_um - 20.0).abs() < 1e-9);
        // A lag of 0.1 s is within 5 % after ln 20 = 3.0 of it; a reading is a millisecond.
        assert!((figures.t95_ms - 299.6).abs() < 1.5, "{}", figures.t95_ms);
        // What is left at the end of 3 s is e^-30.
        assert!(figures.overshoot_percent < 1e-3);
        // A lag of 0.05 rad opens the middle by twice 30 sin 0.05 = 3.0; a bin is 1.5 um wide.
        assert!((figures.loop_um - 3.0).abs() < 0.1, "{}", figures.loop_um);
        assert_eq!(figures.slow_loop_um, 0.0);
    }
}
