//! Drives as they were held. What a voltmeter reads of a held drive jitters, and the drive has moved where its readings move by
//! more than they jitter.

use crate::{ACTUATORS, Row, median};

/// Fourth differences cancel any cubic, which a drive is over five rows of a hold or a ramp; its jitter stays.
pub const DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// The median magnitude of normal numbers, in standard deviations: the normal distribution's third quartile.
pub const MEDIAN_OF_NORMAL: f64 = 0.6745;
/// A step of the drive is in one first difference, and in five of the fourth ones: of stairs of few rows most first differences are within a
/// hold.
const FIRST_DIFFERENCE: [f64; 2] = [1.0, -1.0];
/// Fewer differences than this say nothing: their median is then off by a fifth or more.
const ENOUGH: usize = 40;
/// What moves by a larger part of the highest drive from row to row is driven, and by a smaller one is the rounding of numbers.
const MOST_JITTER: f64 = 0.05;
const LEAST_JITTER: f64 = 1e-9;
/// A last digit that flickers is at most this part of the highest drive: a voltmeter of 500 counts.
const MOST_FLICKER: f64 = 2e-3;
/// So many of a hundred changes by one last digit go back to where they came from, if they are a flicker and no stairs.
const FLICKERS: f64 = 0.9;
/// A drive has moved between two rows that differ by so many standard deviations, and within a hold where two means differ by so
/// many of their own: of a million rows one is so far off by chance in a thousand files.
const STEP: f64 = 8.0;
const MOVED: f64 = 6.0;
/// A hold is level whose slope is less than so many standard deviations from 0; pieces of a ramp, which end where a step would be seen,
/// are steeper.
const LEVEL: f64 = 3.0;
/// Sums over two million rows are rounded by less than this (V).
const ROUNDING_V: f64 = 1e-7;
/// A hold has so many rows at least, and half of all rows are in holds, or the drive was not held.
const ROWS_OF_A_HOLD: usize = 5;

/// The drives of rows that were read off a meter, as they were held.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// The mean of each row's hold (V).
    pub volts: Vec<[f64; ACTUATORS]>,
    /// How far such a mean may be off, one standard deviation, in the median row (V).
    pub noise_v: f64,
    /// The jitter of a single reading, one standard deviation (V).
    pub jitter_v: f64,
}

impl Held {
    /// What was done to the drives, in words.
    pub fn sentence(&self) -> String {
        format!(
            "the drive jitters by {:.2} mV (one standard deviation): each hold is taken at its mean",
            1e3 * self.jitter_v
        )
    }
}

/// The drives of these rows as they were held; `None` where nothing jitters, or where the drive was not held.
pub fn held(rows: &[Row]) -> Option<Held> {
    let jitters: [f64; ACTUATORS] = std::array::from_fn(|actuator| {
        let volts: Vec<f64> = rows.iter().map(|row| row.voltage_v[actuator]).collect();
        jitter(&volts)
    });
    let jitter_v = jitters.into_iter().fold(0.0, f64::max);
    if jitter_v == 0.0 {
        return None;
    }
    let sums = Sums::of(rows, jitters);
    let holds = sums.holds()?;
    let in_holds: usize = holds
        .iter()
        .filter(|&&hold| sums.is_level(hold))
        .map(|(begin, end)| end - begin)
        .sum();
    if 2 * in_holds < rows.len() {
        return None;
    }
    let mut volts = Vec::with_capacity(rows.len());
    for &(begin, end) in &holds {
        let mean = std::array::from_fn(|actuator| sums.mean(actuator, begin, end));
        volts.extend(std::iter::repeat_n(mean, end - begin));
    }
    let mut lengths: Vec<usize> = holds
        .iter()
        .flat_map(|(begin, end)| std::iter::repeat_n(end - begin, end - begin))
        .collect();
    let (_, median, _) = lengths.select_nth_unstable(rows.len() / 2);
    Some(Held {
        volts,
        noise_v: jitter_v / (*median as f64).sqrt(),
        jitter_v,
    })
}

/// One standard deviation of a drive's readings about the drive (V); 0 where they are exact.
fn jitter(volts: &[f64]) -> f64 {
    let highest = volts.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if volts.len() < ENOUGH + DIFFERENCE.len() {
        return 0.0;
    }
    // What the drive does adds to either, so the smaller is nearer.
    let of_readings = scatter(volts, &DIFFERENCE).min(scatter(volts, &FIRST_DIFFERENCE));
    let jitter = of_readings.max(flicker(volts, highest));
    let is_one = (LEAST_JITTER * highest..=MOST_JITTER * highest).contains(&jitter);
    if is_one { jitter } else { 0.0 }
}

/// One standard deviation of white noise that has such differences.
fn scatter(volts: &[f64], weights: &[f64]) -> f64 {
    let gain = weights.iter().map(|d| d * d).sum::<f64>().sqrt();
    let difference = |part: &[f64]| part.iter().zip(weights).map(|(v, d)| v * d).sum::<f64>();
    let parts = volts.windows(weights.len());
    median(parts.map(|part| difference(part).abs() / gain).collect()) / MEDIAN_OF_NORMAL
}

/// The jitter of readings whose last digit alone changes, now and then: half of that digit.
fn flicker(volts: &[f64], highest: f64) -> f64 {
    let changes: Vec<f64> = volts
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|change| change.abs() > LEAST_JITTER * highest)
        .collect();
    let digit = changes
        .iter()
        .fold(f64::INFINITY, |least, c| least.min(c.abs()));
    let small: Vec<f64> = changes
        .into_iter()
        .filter(|change| change.abs() < 1.5 * digit)
        .collect();
    let back = small.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
    let is_flicker = small.len() >= ENOUGH
        && digit <= MOST_FLICKER * highest
        && back.count() as f64 >= FLICKERS * (small.len() - 1) as f64;
    if is_flicker { 0.5 * digit } else { 0.0 }
}

/// Running sums of drives.
struct Sums {
    /// Of the rows before each, in V.
    of: [Vec<f64>; ACTUATORS],
    /// The same of each row's number times its drive.
    moments: [Vec<f64>; ACTUATORS],
    jitters: [f64; ACTUATORS],
}

type Span = (usize, usize);

impl Sums {
    fn of(rows: &[Row], jitters: [f64; ACTUATORS]) -> Self {
        let running = |weight: &dyn Fn(usize) -> f64, actuator: usize| {
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            sums.extend(rows.iter().enumerate().map(|(index, row)| {
                sum += weight(index) * row.voltage_v[actuator];
                sum
            }));
            sums
        };
        Self {
            of: std::array::from_fn(|actuator| running(&|_| 1.0, actuator)),
            moments: std::array::from_fn(|actuator| running(&|index| index as f64, actuator)),
            jitters,
        }
    }

    fn rows(&self) -> usize {
        self.of[0].len() - 1
    }

    fn mean(&self, actuator: usize, begin: usize, end: usize) -> f64 {
        (self.of[actuator][end] - self.of[actuator][begin]) / (end - begin) as f64
    }

    /// How far two neighbouring spans differ, in standard deviations of their means.
    fn apart(&self, begin: usize, middle: usize, end: usize) -> f64 {
        let share = 1.0 / (middle - begin) as f64 + 1.0 / (end - middle) as f64;
        let of = |actuator: usize| {
            let step = self.mean(actuator, middle, end) - self.mean(actuator, begin, middle);
            let jitter = self.jitters[actuator];
            match step.abs() {
                // What is exact has moved where it differs by more than the sums are rounded.
                step if jitter == 0.0 && step > ROUNDING_V => f64::INFINITY,
                _ if jitter == 0.0 => 0.0,
                step => step / (jitter * share.sqrt()),
            }
        };
        (0..ACTUATORS).map(of).fold(0.0, f64::max)
    }

    /// The holds, one after the other; `None` where they are shorter than holds are.
    fn holds(&self) -> Option<Vec<Span>> {
        let rows = self.rows();
        let mut steps = vec![0];
        steps.extend((1..rows).filter(|&row| self.apart(row - 1, row, row + 1) >= STEP));
        steps.push(rows);
        let mut open: Vec<Span> = steps.windows(2).map(|pair| (pair[0], pair[1])).collect();
        open.reverse();
        let mut holds = Vec::new();
        while let Some((begin, end)) = open.pop() {
            let moved = (begin + 1..end)
                .map(|middle| (middle, self.apart(begin, middle, end)))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|&(_, apart)| apart >= MOVED);
            match moved {
                // Binary segmentation (A. J. Scott, M. Knott, Biometrics 30 (1974) 507-512).
                Some((middle, _)) => open.extend([(middle, end), (begin, middle)]),
                None => holds.push((begin, end)),
            }
            if (holds.len() + open.len()) * ROWS_OF_A_HOLD > rows {
                return None;
            }
        }
        Some(holds)
    }

    /// Whether a span is long enough, and nothing rises or falls in it.
    fn is_level(&self, (begin, end): Span) -> bool {
        let count = (end - begin) as f64;
        let middle = 0.5 * (begin + end - 1) as f64;
        let about = count * (count * count - 1.0) / 12.0;
        let is_level = |actuator: usize| {
            let moment = self.moments[actuator][end] - self.moments[actuator][begin];
            let sum = self.of[actuator][end] - self.of[actuator][begin];
            let slope = (moment - middle * sum) / about;
            slope.abs() * about.sqrt() <= LEVEL * self.jitters[actuator]
        };
        let mut jitter = (0..ACTUATORS).filter(|&actuator| self.jitters[actuator] > 0.0);
        end - begin >= ROWS_OF_A_HOLD && jitter.all(is_level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal numbers, roughly, that repeat: sums of twelve uniform ones.
    struct Normal(u64);

    impl Normal {
        fn next(&mut self) -> f64 {
            let mut uniform = || {
                // Knuth's MMIX generator.
                self.0 = self
                    .0
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                (self.0 >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    fn rows(drive: impl Fn(usize) -> f64, count: usize, jitter_v: f64) -> Vec<Row> {
        let mut normal = Normal(17);
        let row = |index| Row {
            t_s: index as f64 * 1e-3,
            voltage_v: [drive(index) + jitter_v * normal.next(); ACTUATORS],
            ..Row::default()
        };
        (0..count).map(row).collect()
    }

    fn stairs(index: usize) -> f64 {
        0.5 * (index / 200) as f64
    }

    #[test]
    fn a_hold_is_its_mean_and_the_jitter_is_known() {
        let found = held(&rows(stairs, 1600, 4e-3)).expect("holds");
        // The deviation of 1600 numbers is known to 1 / sqrt(2 * 1600), 2 %: five of these.
        assert!(
            (found.jitter_v / 4e-3 - 1.0).abs() < 0.1,
            "{}",
            found.jitter_v
        );
        // Of 200 rows.
        assert!((found.noise_v / found.jitter_v * 200f64.sqrt() - 1.0).abs() < 1e-9);
        for (index, volts) in found.volts.iter().enumerate() {
            // Five standard deviations of such a mean.
            assert!(
                (volts[0] - stairs(index)).abs() < 5.0 * found.noise_v,
                "row {index}"
            );
        }
    }

    #[test]
    fn what_is_exact_or_not_held_stays_as_it_is() {
        assert!(held(&rows(stairs, 1600, 0.0)).is_none(), "exact");
        let sine = |index: usize| 2.0 + (index as f64 / 40.0).sin();
        assert!(held(&rows(sine, 1600, 4e-3)).is_none(), "a sine");
        let ramp = |index: usize| 2e-3 * index as f64;
        assert!(held(&rows(ramp, 1600, 4e-3)).is_none(), "a ramp");
        let any = |index: usize| ((index * 7919) % 31) as f64 * 0.1;
        assert!(held(&rows(any, 400, 0.0)).is_none(), "a level a row");
        assert!(
            held(&rows(any, 400, 4e-3)).is_none(),
            "the same, read off a meter"
        );
    }

    #[test]
    fn stairs_of_a_few_rows_are_exact() {
        for rows_of_a_step in 2..=12 {
            for step_v in [0.05, 0.1, 0.25] {
                let few = |index: usize| step_v * (index / rows_of_a_step) as f64;
                let count = (3.5 / step_v) as usize * rows_of_a_step;
                let found = held(&rows(few, count, 0.0));
                assert!(found.is_none(), "{rows_of_a_step} rows of {step_v} V");
            }
        }
    }

    #[test]
    fn a_last_digit_that_flickers_is_no_step() {
        let flicker = |index: usize| stairs(index) + if index % 9 == 3 { 1e-3 } else { 0.0 };
        let found = held(&rows(flicker, 1600, 0.0)).expect("holds");
        assert!(
            found
                .volts
                .windows(2)
                .filter(|pair| pair[0] != pair[1])
                .count()
                <= 7
        );
        // Stairs of one digit each are a drive.
        let fine = |index: usize| 1e-3 * (index / 20) as f64;
        assert!(held(&rows(fine, 1600, 0.0)).is_none());
    }

    #[test]
    fn steps_of_a_few_standard_deviations_are_seen() {
        let small = |index: usize| if index < 800 { 2.0 } else { 2.006 };
        let found = held(&rows(small, 1600, 4e-3)).expect("holds");
        let steps: Vec<usize> = (1..1600)
            .filter(|&row| found.volts[row] != found.volts[row - 1])
            .collect();
        // At one and a half standard deviations the place of a step is told to a few rows.
        assert!(
            matches!(steps[..], [step] if step.abs_diff(800) < 10),
            "{steps:?}"
        );
    }
}
