//! What refines and tries a calibration: positions all over the range that the board reaches with it.

use std::iter;

use crate::experiment::{Experiment, Quantity, Run, Signal, Wave};
use crate::reading::Reading;

/// The part of what the highest drive reaches that is used: up there nothing is left to correct with.
pub const RANGE: f64 = 0.99;

/// How much of the board's time a calibration takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Positions that the mirror jumps to while the calibration is refined, at most.
    pub jumps: usize,
    /// Time at 0 V before these (s): creep of 40 s, the slowest of the foreign mirrors (`foreign-mirror`), goes back by nine tenths, or two thirds.
    pub jumps_after_s: f64,
    /// Positions at rest that are tried, and how long each is held before it is read (s).
    pub rests: usize,
    /// How long each is held (s).
    pub rest_s: f64,
    /// How long each end of the step that is tried is held (s); what is still missing then is creep.
    pub hold_s: f64,
    /// Before each part of a trial the mirror cools so long (s).
    pub cooling_s: f64,
}

impl Effort {
    /// What a calibration takes unless it is to be quick.
    pub const USUAL: Self = Self {
        jumps: usize::MAX,
        jumps_after_s: 90.0,
        rests: 17,
        rest_s: 2.0,
        hold_s: 3.0,
        cooling_s: 5.0,
    };
    /// Two thirds of the time, and a little coarser.
    pub const QUICK: Self = Self {
        jumps: 31,
        jumps_after_s: 45.0,
        rests: 8,
        rest_s: 1.0,
        hold_s: 1.0,
        cooling_s: 1.0,
    };
}

/// The plate is heard after a jump to this part of the highest drive (V) and one back, each held so long (s), after a rest of four of the
/// slowest time constants of usual mirrors.
const RINGING_SHARE: f64 = 0.6;
const RINGING_S: f64 = 0.06;
const RINGING_AFTER_S: f64 = 2.0;

/// What is measured first and last, as shares of the highest drive: at rest, at the top, half way, and hardly driven, where heaters tell the
/// room.
pub const CHECKED_SHARES: [f64; 4] = [0.0, 1.0, 0.5, 0.1];
/// Then so many actuators alone at the highest drive: two neighbours tilt the plate about both its axes by degrees, so that a spot which has
/// moved reads another height.
pub const CHECKED_ALONE: usize = 2;
/// Each is held so long (s), as the steps of a sweep are.
const CHECKED_S: f64 = 1.0;
/// After them the mirror cools so long (s), four of the time constants of the paper's frame, 4.7 s; and before them, where it was driven until
/// then.
pub const CHECKED_REST_S: f64 = 20.0;
/// Readings in a second of it: what jumps shows beside what settles.
pub const CHECKED_READINGS: usize = 10;

/// Far jumps, each followed by a near one.
const FAR: usize = 30;
/// Part of the range from one far place to the next, up and down: the golden section visits all of it evenly (Knuth, The
/// Art of Computer Programming 3, section 6.4).
const STRIDE: f64 = 0.618_033_988_75;
/// So many far jumps a time, the last of them to the top, where a fit is held from one side only: visited but once, mirrors were left up to
/// 0.35 um off there.
const TOP_EVERY: usize = 6;
/// Where they begin, as a share of the range: in its middle.
const BEGIN: f64 = 0.5;
/// Near jumps, as shares of the range, in turn: the sizes at which the hysteresis operators' thresholds lie.
const NEAR: [f64; 6] = [0.02, -0.03, 0.06, -0.1, 0.15, -0.05];
/// How long each is held (s): ten of the slowest time constants that a board inverts.
const JUMP_S: f64 = 2.0;

/// Sines of positions, frequency (Hz) and amplitude as a share of the range, for what jumps do not tell: heat and friction while the mirror
/// keeps moving. The last is as fast as a move of 2 ms, and so small that a mirror cools fast enough which takes 16 ms over half of its range.
const SINES: [(f64, f64); 5] = [
    (1.0, 0.12),
    (5.0, 0.12),
    (20.0, 0.12),
    (100.0, 0.12),
    (250.0, 0.02),
];
/// Their middle, as a share of the range: in its lower half, where a mirror cools fast enough.
const SINES_MIDDLE: f64 = 0.25;
const SINE_CYCLES: u32 = 6;
/// The share of their length in which the mirror is still on its way there from rest.
pub const ON_ITS_WAY: f64 = 1.0 / 3.0;
const SINE_READINGS: u32 = 600;
/// Time at 0 V before each (s): four of the slowest time constants of usual mirrors, 0.5 s.
const SINE_AFTER_S: f64 = 2.0;

/// Positions that the tables are corrected at, evenly over the range.
pub const POINTS: usize = 33;
/// From one of them to the next that is measured: the way jumps about as in use, where what the mirror remembers of the
/// way does not always point to the same side. It and [`POINTS`] have no common divisor, so that all are visited.
const POINT_STRIDE: usize = 14;
/// A position is held so long before it is read (s): four of the slowest time constants of usual mirrors, 0.5 s.
const POINT_DWELL_S: f64 = 2.0;
/// Time at 0 V before these (s): twenty of those.
const POINTS_AFTER_S: f64 = 10.0;

/// Where a trial rests, as shares of the range: positions that no table was made from, 0.3 % of the
/// range away at least.
const REST_SHARES: [f64; 17] = [
    0.52, 0.13, 0.87, 0.31, 0.69, 0.05, 0.99, 0.42, 0.78, 0.22, 0.59, 0.11, 0.89, 0.36, 0.64, 0.17,
    0.83,
];
/// Where it steps from and to, as shares of the range.
const STEP_SHARES: (f64, f64) = (0.25, 0.7);
/// The sines of a trial leave out the cold end, where no drive is left to cool the mirror with: middle and amplitude as
/// shares of the range.
const TRIED_SINE: (f64, f64) = (0.5, 0.12);
/// So does the triangle, which is where a mirror cools fast enough.
const TRIED_TRIANGLE: (f64, f64) = (0.35, 0.115);
/// Readings along a signal of a trial.
const TRIED_READINGS: u32 = 1500;

/// Jumps of a drive up to `max_v` that the plate rings after, read as fast as the board can.
pub fn ringing(max_v: f64) -> Experiment {
    Experiment::step(RINGING_SHARE * max_v, RINGING_S, f64::INFINITY)
        .named("ringing")
        .after(RINGING_AFTER_S)
}

/// What is measured first and last on a board that drives up to `max_v`, so that what moves in between shows: [`CHECKED_SHARES`],
/// [`CHECKED_ALONE`] and a rest.
pub fn drift_check(max_v: f64) -> Experiment {
    let held = |share: f64, seconds: f64| {
        let readings = (seconds * CHECKED_READINGS as f64).round() as usize;
        vec![share * max_v; readings]
    };
    let run = |quantity: Quantity, values: Vec<f64>| {
        let dwell_s = CHECKED_S / CHECKED_READINGS as f64;
        Run::new(quantity, Signal::Steps { values, dwell_s })
    };
    let together = CHECKED_SHARES.map(|share| held(share, CHECKED_S)).concat();
    let alone = (0..CHECKED_ALONE).map(|it| run(Quantity::alone(it), held(1.0, CHECKED_S)));
    let runs = iter::once(run(Quantity::TOGETHER, together))
        .chain(alone)
        .chain([run(Quantity::TOGETHER, held(0.0, CHECKED_REST_S))]);
    Experiment::new("drift check", Reading::EndOfDwell, runs.collect())
}

/// What refines a calibration that reaches up to `top_um`, where a sensor is read at every tick: jumps all over the range,
/// and sines.
pub fn moves(effort: &Effort, top_um: f64) -> Vec<Experiment> {
    let positions: Vec<f64> = jump_shares()
        .take(effort.jumps)
        .map(|share| share * top_um)
        .collect();
    let jumps = Experiment::jumps("moves", &positions, JUMP_S).after(effort.jumps_after_s);
    let sine = |(hz, amplitude): (f64, f64)| {
        let signal = Signal::Sine(wave((SINES_MIDDLE, amplitude), top_um, hz));
        Experiment::along(&format!("moves_{hz}"), signal, SINE_CYCLES, SINE_READINGS)
            .after(SINE_AFTER_S)
    };
    iter::once(jumps).chain(SINES.map(sine)).collect()
}

/// What corrects the tables of a calibration that reaches up to `top_um`, where a sensor is read at rest. There and back:
/// every position is reached once from below and once from above.
pub fn rests(top_um: f64) -> Experiment {
    let position = |point: usize| top_um * (point + 1) as f64 / POINTS as f64;
    let way: Vec<usize> = (0..POINTS)
        .map(|step| step * POINT_STRIDE % POINTS)
        .collect();
    let there_and_back: Vec<f64> = way
        .iter()
        .chain(way.iter().rev())
        .map(|&point| position(point))
        .collect();
    Experiment::positions("correcting", &there_and_back, POINT_DWELL_S).after(POINTS_AFTER_S)
}

/// What a calibration is tried by.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Positions at rest.
    pub rest: Experiment,
    /// A step upwards, after a rest at its lower end.
    pub step: Experiment,
    /// A sine of 1 Hz.
    pub slow_sine: Experiment,
    /// A sine of 20 Hz.
    pub fast_sine: Experiment,
    /// A triangle of 20 Hz.
    pub triangle: Experiment,
}

impl Trial {
    /// The trial of a calibration that reaches up to `top_um`.
    pub fn new(effort: &Effort, top_um: f64) -> Self {
        let rests: Vec<f64> = REST_SHARES
            .into_iter()
            .take(effort.rests)
            .map(|share| share * top_um)
            .collect();
        let (from, to) = STEP_SHARES;
        let step = [from * top_um, to * top_um];
        let along = |name: &str, signal, cycles| {
            Experiment::along(name, signal, cycles, TRIED_READINGS).after(effort.cooling_s)
        };
        let sine = |name, hz| along(name, Signal::Sine(wave(TRIED_SINE, top_um, hz)), 3);
        let triangle = Signal::Triangle(wave(TRIED_TRIANGLE, top_um, 20.0));
        Self {
            rest: Experiment::positions("rest", &rests, effort.rest_s).after(effort.cooling_s),
            step: Experiment::jumps("step", &step, effort.hold_s).after(effort.cooling_s),
            slow_sine: sine("slow loop", 1.0),
            fast_sine: sine("loop", 20.0),
            triangle: along("triangle", triangle, 6),
        }
    }

    /// All of it, in the order in which it is played.
    pub fn experiments(self) -> [Experiment; 5] {
        [
            self.rest,
            self.step,
            self.slow_sine,
            self.fast_sine,
            self.triangle,
        ]
    }
}

/// Jumps one after the other, as shares of the range: far ones for heat and creep, near ones for the hysteresis operators.
pub fn jump_shares() -> impl Iterator<Item = f64> {
    let near = |far: f64, by: f64| {
        let there = far + by;
        if (0.0..=1.0).contains(&there) {
            there
        } else {
            far - by
        }
    };
    let far_place = |k: usize| match (k + 1).is_multiple_of(TOP_EVERY) {
        true => 1.0,
        false => (BEGIN + STRIDE * (k - k / TOP_EVERY) as f64).fract(),
    };
    let places = (0..FAR).flat_map(move |k| {
        let far = far_place(k);
        [far, near(far, NEAR[k % NEAR.len()])]
    });
    iter::once(1.0).chain(places)
}

fn wave((mean, amplitude): (f64, f64), top_um: f64, frequency_hz: f64) -> Wave {
    Wave {
        mean: mean * top_um,
        amplitude: amplitude * top_um,
        frequency_hz,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruments::SENSE_BIAS_V;

    const TOP_UM: f64 = 170.0;

    fn range(experiment: &Experiment) -> (f64, f64) {
        experiment.runs[0].signal.range()
    }

    #[test]
    fn nothing_leaves_the_range() {
        for effort in [Effort::USUAL, Effort::QUICK] {
            let mut all = moves(&effort, TOP_UM);
            all.push(rests(TOP_UM));
            all.extend(Trial::new(&effort, TOP_UM).experiments());
            for experiment in all {
                let (low, high) = range(&experiment);
                assert!(
                    low > 0.0 && high <= TOP_UM,
                    "{}: {low} {high}",
                    experiment.name
                );
            }
        }
    }

    #[test]
    fn a_drift_check_begins_and_ends_at_rest() {
        let check = drift_check(3.5);
        // Four drives and two of one actuator, of a second each, and 20 s at rest.
        assert!((check.duration_s() - 26.0).abs() < 1e-9);
        let dwells = check.dwells().expect("drives");
        let volts: Vec<f64> = dwells.iter().map(|dwell| dwell.to_v[2]).collect();
        let seconds: Vec<&[f64]> = volts.chunks(CHECKED_READINGS).collect();
        let is_held = |second: &&[f64]| second.iter().all(|volts| *volts == second[0]);
        assert!(seconds.iter().all(is_held));
        let of_each: Vec<f64> = seconds.iter().map(|second| second[0]).collect();
        assert_eq!(of_each[..4], [0.0, 3.5, 1.75, 0.1 * 3.5]);
        // Two others alone, by which this one shows its resistance.
        assert_eq!(of_each[4..6], [SENSE_BIAS_V; 2]);
        assert_eq!(of_each[6..], [0.0; 20]);
        let alone = dwells[5 * CHECKED_READINGS].to_v;
        assert_eq!(alone[..2], [SENSE_BIAS_V, 3.5]);
    }

    #[test]
    fn jumps_visit_every_tenth_of_the_range_and_its_top_more_than_once() {
        let positions: Vec<f64> = jump_shares().collect();
        assert_eq!(positions.len(), 61);
        for tenth in 0..10 {
            let there = |share: &&f64| (**share * 10.0) as usize == tenth;
            assert!(positions.iter().filter(there).count() >= 3, "{tenth}");
        }
        let to_the_top = |jumps: usize| {
            positions
                .iter()
                .take(jumps)
                .filter(|share| **share == 1.0)
                .count()
        };
        assert_eq!(
            [Effort::QUICK, Effort::USUAL].map(|effort| to_the_top(effort.jumps)),
            [3, 6]
        );
    }

    #[test]
    fn every_point_is_reached_twice() {
        let Signal::Steps { values, .. } = rests(TOP_UM).runs.remove(0).signal else {
            panic!("positions at rest");
        };
        let mut sorted = values;
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        assert_eq!(sorted.len(), POINTS);
        assert_eq!(sorted.last(), Some(&TOP_UM));
    }

    #[test]
    fn a_trial_is_elsewhere_than_what_the_tables_were_corrected_at() {
        let trial = Trial::new(&Effort::USUAL, 1.0);
        let (Signal::Steps { values: tried, .. }, Signal::Steps { values: made, .. }) =
            (&trial.rest.runs[0].signal, &rests(1.0).runs[0].signal)
        else {
            panic!("positions at rest");
        };
        for share in tried {
            assert!(
                made.iter().all(|point| (point - share).abs() > 3e-3),
                "{share}"
            );
        }
    }
}
