//! Which of a sensor's readings bear weight: all but those that are missing, stand alone beside their neighbours, stay the same while
//! the mirror is driven on, or stand at an end of the sensor's range.

use std::fmt;
use std::ops::Range;

use experiments::Reading;
use measurement::{MeasurementFile, Row, median_and_deviation};
use serde::Serialize;

/// Readings on each side that one is held against (Hampel's identifier).
const NEIGHBOURS: usize = 3;
/// With the reading itself.
const AROUND: usize = 2 * NEIGHBOURS + 1;
/// Of the neighbours' scatter (Hampel, J. Am. Stat. Assoc. 69 (1974) 383: three are usual). Twice as much, for a mirror that
/// rings is no outlier.
const SCATTERS: f64 = 6.0;
/// From the median absolute deviation of a normal distribution to its standard deviation: 1 / 0.6745, its third quartile.
const NORMAL: f64 = 1.4826;
/// The least scatter that is known of a sensor (um), where its noise is not: its last digit.
const LEAST_NOISE_UM: f64 = 1e-3;
/// So many readings that are the same to the last digit, at drives that differ, stand at an end of the sensor's range, or still.
const SAME: usize = 8;
/// Drives that differ by more than this move a mirror by more than a last digit (V).
const MOVES_V: f64 = 0.02;
/// The part of an experiment's readings that may bear no weight. With more, what the mirror does between them is a guess.
pub(crate) const MOST_WITHOUT: f64 = 0.2;

/// A sensor's readings, and those of them that bear no weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ReadingCounts {
    /// Rows that were to be read.
    pub asked: usize,
    /// Without a number.
    pub missing: usize,
    /// Far from their neighbours on both sides.
    pub outlying: usize,
    /// The same as before while the mirror was driven on.
    pub repeated: usize,
    /// At an end of the sensor's range.
    pub clipped: usize,
}

/// Too few readings of an experiment bear weight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "in `{experiment}`, of {} readings of the sensor {} bear no weight: {counts}",
    counts.asked,
    counts.without_weight()
)]
pub struct SensorError {
    /// The experiment.
    pub experiment: String,
    /// Its readings.
    pub counts: ReadingCounts,
}

impl ReadingCounts {
    /// Readings that bear no weight.
    pub fn without_weight(&self) -> usize {
        self.missing + self.outlying + self.repeated + self.clipped
    }

    pub(crate) fn add(&mut self, more: Self) {
        self.asked += more.asked;
        self.missing += more.missing;
        self.outlying += more.outlying;
        self.repeated += more.repeated;
        self.clipped += more.clipped;
    }
}

/// What of them bears no weight, and why.
impl fmt::Display for ReadingCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            missing,
            outlying,
            repeated,
            clipped,
            ..
        } = self;
        write!(
            f,
            "{missing} missing, {outlying} alone beside their neighbours, "
        )?;
        write!(
            f,
            "{repeated} the same as before while the mirror was driven on, {clipped} at an end of its range"
        )
    }
}

/// Takes the readings that bear no weight out of a file, and counts them.
pub(crate) fn screen(file: &mut MeasurementFile, reading: Reading) -> ReadingCounts {
    let noise_um = file.keys.displacement_noise_um().unwrap_or(0.0);
    let scatter_um = noise_um.max(LEAST_NOISE_UM);
    let Unmoved { clipped, repeated } = Unmoved::of(&file.rows);
    let mut counts = ReadingCounts {
        asked: file.rows.len(),
        ..ReadingCounts::default()
    };
    counts.clipped = take_out(&mut file.rows, clipped);
    counts.repeated = take_out(&mut file.rows, repeated);
    // One reading a dwell has no neighbours of its own place.
    if reading != Reading::EndOfDwell {
        let outlying = outlying(&file.rows, scatter_um);
        counts.outlying = take_out(&mut file.rows, outlying);
    }
    let without = file.rows.iter().filter(|row| row.z_um.is_none()).count();
    counts.missing = without - counts.clipped - counts.repeated - counts.outlying;
    counts
}

/// Takes the readings out of these rows; how many there were.
fn take_out(rows: &mut [Row], places: Vec<usize>) -> usize {
    let taken = places
        .into_iter()
        .filter_map(|place| rows[place].z_um.take());
    taken.count()
}

/// Rows whose readings are far from their neighbours' median, beside the neighbours' own scatter. Along a way up or down the
/// median is the reading itself, however steep it is.
fn outlying(rows: &[Row], scatter_um: f64) -> Vec<usize> {
    let read: Vec<(usize, f64)> = rows
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((index, row.z_um?)))
        .collect();
    let is_outlying = |place: &usize| {
        // At the ends of the file the neighbours are on one side.
        let first = place.saturating_sub(NEIGHBOURS);
        let first = first.min(read.len().saturating_sub(AROUND));
        let around = &read[first..(first + AROUND).min(read.len())];
        let (median_um, deviation_um) = median_and_deviation(around.iter().map(|(_, um)| *um));
        (read[*place].1 - median_um).abs() > SCATTERS * scatter_um.max(NORMAL * deviation_um)
    };
    let places = (0..read.len()).filter(is_outlying);
    places.map(|place| read[place].0).collect()
}

/// Readings that stay the same while the drive does not.
struct Unmoved {
    /// At the file's lowest or highest.
    clipped: Vec<usize>,
    /// Between them, or at them where it stays elsewhere, too.
    repeated: Vec<usize>,
}

impl Unmoved {
    fn of(rows: &[Row]) -> Self {
        let read = || rows.iter().filter_map(|row| row.z_um);
        let ends = [
            read().fold(f64::INFINITY, f64::min),
            read().fold(f64::NEG_INFINITY, f64::max),
        ];
        let is_end = |run: &Range<usize>| rows[run.start].z_um.is_some_and(|um| ends.contains(&um));
        let runs = runs(rows);
        // A sensor that is coarse, or slow, repeats itself wherever the mirror stands, as it does where a drive leads the beams' lag.
        let is_fine = 2 * runs.iter().filter(|run| run.len() == 1).count() >= read().count();
        let (ends, between): (Vec<_>, Vec<_>) = runs
            .into_iter()
            .filter(|run| run.len() >= SAME && moves(&rows[run.clone()]))
            .partition(is_end);
        match is_fine && !between.is_empty() {
            true => Self {
                clipped: Vec::new(),
                repeated: ends.into_iter().chain(between).flatten().collect(),
            },
            false => Self {
                clipped: ends.into_iter().flatten().collect(),
                repeated: Vec::new(),
            },
        }
    }
}

/// Readings in a row that are the same, alone or with others.
fn runs(rows: &[Row]) -> Vec<Range<usize>> {
    let mut first = 0;
    let runs = rows.chunk_by(|a, b| a.z_um == b.z_um).map(|run| {
        first += run.len();
        first - run.len()..first
    });
    runs.filter(|run| rows[run.start].z_um.is_some()).collect()
}

fn moves(run: &[Row]) -> bool {
    let drives_v = || {
        run.iter()
            .map(|row| row.voltage_v.iter().sum::<f64>() / row.voltage_v.len() as f64)
    };
    drives_v().fold(f64::MIN, f64::max) - drives_v().fold(f64::MAX, f64::min) > MOVES_V
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVENLY: Reading = Reading::Evenly { readings: 1000 };

    /// A sine of 2 Hz read at 1 kHz, with the noise of a sensor; every reading by what `change` makes of it.
    fn sine(change: impl Fn(usize, f64) -> Option<f64>) -> MeasurementFile {
        let mut file = MeasurementFile::default();
        file.keys.set("noise_z_nm", "20");
        for index in 0..1000 {
            let t_s = index as f64 * 1e-3;
            let phase = (2.0 * std::f64::consts::TAU * t_s).sin();
            // What repeats only after a prime number of readings stands for noise of 20 nm.
            let noise_um = 0.02 * 1.7 * ((index * 37 % 101) as f64 / 50.0 - 1.0);
            file.rows.push(Row {
                t_s,
                voltage_v: [1.5 + 0.5 * phase; 4],
                z_um: change(index, 80.0 + 30.0 * phase + noise_um),
                ..Row::default()
            });
        }
        file
    }

    fn counts(missing: usize, outlying: usize, clipped: usize) -> ReadingCounts {
        ReadingCounts {
            asked: 1000,
            missing,
            outlying,
            repeated: 0,
            clipped,
        }
    }

    #[test]
    fn a_sound_sensor_loses_no_reading() {
        let mut file = sine(|_, um| Some(um));
        let before = file.clone();
        assert_eq!(screen(&mut file, EVENLY), counts(0, 0, 0));
        assert_eq!(file, before);
    }

    #[test]
    fn readings_that_are_missing_or_alone_are_taken_out_and_counted() {
        let mut file = sine(|index, um| match index {
            i if i % 250 == 100 => None,
            // At its top, where it hardly moves.
            125 => Some(um + 1.0),
            500 => Some(um - 40.0),
            501 => Some(um + 40.0),
            // At the ends, and beside them.
            0 | 999 => Some(um + 40.0),
            2 => Some(um - 40.0),
            _ => Some(um),
        });
        assert_eq!(screen(&mut file, EVENLY), counts(4, 6, 0));
        assert!(
            [0, 2, 125, 500, 501, 999]
                .iter()
                .all(|&i| file.rows[i].z_um.is_none())
        );
    }

    #[test]
    fn an_end_of_the_sensors_range_is_no_reading() {
        let clips = |_, um: f64| Some(um.clamp(60.0, 100.0));
        let mut file = sine(clips);
        let found = screen(&mut file, EVENLY);
        // Beyond 20 of 30 um on both sides: 2 acos(2/3) / pi of the time.
        let share = 2.0 * (2.0_f64 / 3.0).acos() / std::f64::consts::PI;
        // Noise at the edges, six crossings of some readings.
        assert!(
            (found.clipped as f64 - 1000.0 * share).abs() < 30.0,
            "{found:?}"
        );
        assert!(found.without_weight() as f64 > MOST_WITHOUT * 1000.0);
    }

    /// Each reading held as `held` says, by the index of the one that is held.
    fn holding(held: impl Fn(usize) -> usize) -> ReadingCounts {
        let sound = sine(|_, um| Some(um));
        let mut file = sine(|index, _| sound.rows[held(index)].z_um);
        screen(&mut file, EVENLY)
    }

    #[test]
    fn a_sensor_that_stalls_is_told_from_one_at_the_end_of_its_range() {
        // For 60 of each 200 readings, on the way, at the top or at the bottom.
        let found = holding(|index| index - (index % 200).saturating_sub(140));
        assert_eq!((found.repeated, found.clipped), (5 * 60, 0), "{found:?}");
    }

    #[test]
    fn a_sensor_that_is_slow_or_coarse_does_not_stall() {
        assert_eq!(holding(|index| index - index % 12), counts(0, 0, 0));
        // A move up in 2 ms, and a drive that falls by 0.1 V after it as the beams come after.
        let row = |index: usize| {
            let t_s = index as f64 * 1e-4;
            let led = 0.1 * (-t_s / 0.05).exp();
            let z_um = 60.0 * (1.0 - (-t_s / 5e-4).exp());
            Row {
                t_s,
                voltage_v: [1.5 + led; 4],
                z_um: Some((z_um * 4.0).round() / 4.0),
                ..Row::default()
            }
        };
        let end = |index: usize| Row {
            z_um: Some(61.0),
            ..row(index)
        };
        let mut file = MeasurementFile {
            rows: (0..1000).map(row).chain([end(1000)]).collect(),
            ..MeasurementFile::default()
        };
        let found = screen(&mut file, Reading::AfterSteps { rate_hz: 1e4 });
        assert_eq!((found.repeated, found.clipped), (0, 0), "{found:?}");
    }

    #[test]
    fn a_jump_and_its_ringing_are_no_outliers() {
        let mut file = MeasurementFile::default();
        for index in 0..400 {
            // A step at 10 ms into ringing of 1 kHz, Q = 50, read at 10 kHz; before it a quiet sensor of 1 nm.
            let t_s = index as f64 * 1e-4 - 0.01;
            let ringing = (-20.0 * std::f64::consts::TAU / 2.0 * t_s).exp()
                * (std::f64::consts::TAU * 1e3 * t_s).cos();
            let z_um = if t_s < 0.0 {
                20.0
            } else {
                100.0 - 80.0 * ringing
            };
            file.rows.push(Row {
                t_s,
                z_um: Some((z_um * 1e3).round() * 1e-3),
                ..Row::default()
            });
        }
        let found = screen(&mut file, Reading::AfterSteps { rate_hz: 1e4 });
        assert_eq!(found.without_weight(), 0, "{found:?}");
    }

    #[test]
    fn the_rest_of_a_mirror_is_no_end_of_a_range() {
        let rows = (0..100).map(|index| Row {
            t_s: f64::from(index),
            z_um: Some(0.0),
            ..Row::default()
        });
        let mut file = MeasurementFile {
            rows: rows.collect(),
            ..MeasurementFile::default()
        };
        assert_eq!(screen(&mut file, EVENLY).without_weight(), 0);
    }
}
