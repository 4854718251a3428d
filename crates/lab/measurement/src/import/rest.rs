//! Where a displacement counts from: a rest, in which no actuator is driven.

use std::ops::Range;

use crate::Row;

/// A rest tells whether the displacement stands still where it has so many readings: two in each quarter.
const FEWEST: usize = 8;
/// A displacement stands still that moves, from a rest's third quarter to its last, by at most this part of what it went since
/// the drive ended. An exponential that does has 1e-4 left to go.
const STILL: f64 = 0.01;
/// A file begins cold where the displacement goes in its first rest by at most this part of its range in the file.
const COLD: f64 = 0.01;

/// A drive of at most this part of the highest is none that a meter reads: it moves a mirror, which goes by the square, by a millionth.
const NONE: f64 = 1e-3;

/// Lets displacements count from rest, and says from which; leaves them as they are where no rest tells it. Of settled rows each
/// tells it.
pub(super) fn count_from(rows: &mut [Row], is_settled: bool, notes: &mut Vec<String>) {
    let rests = rests(rows);
    let is_read = |rows: &[Row]| rows.iter().any(|row| row.z_um.is_some());
    match zero(rows, &rests, is_settled) {
        Some((0.0, _)) => {}
        Some((zero_um, place)) => {
            for z_um in rows.iter_mut().filter_map(|row| row.z_um.as_mut()) {
                *z_um -= zero_um;
            }
            notes.push(format!("z counts from {place}, which was {zero_um} um"));
        }
        None if rests.iter().any(|rest| is_read(&rows[rest.clone()])) => notes.push(
            "z is left as it is, and is to count from 0 V: what was read there follows a drive and does not stand still; if z \
             counts from elsewhere, record it anew from 0 V, before anything is driven"
                .into(),
        ),
        None if is_read(rows) => notes.push(
            "no displacement was read at 0 V: z is taken to count from there all the same".into(),
        ),
        None => {}
    }
}

/// What is read at rest (um), and where.
fn zero(rows: &[Row], rests: &[Range<usize>], is_settled: bool) -> Option<(f64, String)> {
    let first = |rest: &Range<usize>| {
        let is_cold = is_settled || rest.start == 0 && begins_cold(rows, rest);
        let mut read = rows[rest.clone()].iter().filter_map(|row| row.z_um);
        read.next().filter(|_| is_cold)
    };
    if let Some(z_um) = rests.iter().find_map(first) {
        return Some((z_um, "its first reading at 0 V".into()));
    }
    let still = |rest: &Range<usize>| {
        let z_um = standing_still(rows, rest)?;
        let end_s = rows[rest.end - 1].t_s;
        Some((
            z_um,
            format!("where it stands still at 0 V, before {end_s} s"),
        ))
    };
    rests.iter().find_map(still)
}

/// Runs of rows in which no actuator is driven.
fn rests(rows: &[Row]) -> Vec<Range<usize>> {
    let size_v = |row: &Row| {
        row.voltage_v
            .iter()
            .fold(0.0_f64, |most, v| most.max(v.abs()))
    };
    let highest_v = rows.iter().map(size_v).fold(0.0, f64::max);
    let is_rest = |row: &Row| size_v(row) <= NONE * highest_v;
    let mut end = 0;
    let runs = rows.chunk_by(|a, b| is_rest(a) == is_rest(b));
    let ranges = runs.filter_map(|run| {
        let start = end;
        end += run.len();
        is_rest(&run[0]).then_some(start..end)
    });
    ranges.collect()
}

/// Whether the displacement of the file's first rest does not come back from a drive of before.
fn begins_cold(rows: &[Row], rest: &Range<usize>) -> bool {
    let read = readings(&rows[rest.clone()]);
    let Some([_, last_um]) = quarters(&read) else {
        return true;
    };
    let all = readings(rows);
    let highest = all.iter().copied().fold(f64::MIN, f64::max);
    let lowest = all.iter().copied().fold(f64::MAX, f64::min);
    (read[0] - last_um).abs() <= COLD * (highest - lowest)
}

/// The displacement at a rest's end (um), where it stands still there.
fn standing_still(rows: &[Row], rest: &Range<usize>) -> Option<f64> {
    let read = readings(&rows[rest.clone()]);
    let [third_um, last_um] = quarters(&read)?;
    let driven = readings(&rows[..rest.start]);
    let went_um = driven.last().unwrap_or(&read[0]) - last_um;
    ((third_um - last_um).abs() <= STILL * went_um.abs()).then_some(last_um)
}

fn readings(rows: &[Row]) -> Vec<f64> {
    rows.iter().filter_map(|row| row.z_um).collect()
}

/// Means over the third and the last quarter of readings, where they are enough.
fn quarters(readings: &[f64]) -> Option<[f64; 2]> {
    let quarter = readings.len() / 4;
    let mut backwards = readings.rchunks(quarter.max(1));
    let last = backwards.next()?;
    let third = backwards.next()?;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    (readings.len() >= FEWEST).then(|| [mean(third), mean(last)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ACTUATORS;

    const LAG_S: f64 = 3e-3;
    const OFFSET_UM: f64 = 12.5;

    /// A mirror of one lag that goes by 10 um a volt, read at equal steps while voltages are held for a while each; it starts
    /// where the first `from_v` holds it.
    fn read(from_v: f64, holds: &[(f64, f64)], step_s: f64) -> Vec<Row> {
        let (mut z_um, mut t_s) = (10.0 * from_v, 0.0);
        let mut rows = Vec::new();
        for &(volts, for_s) in holds {
            for _ in 0..(for_s / step_s).round() as usize {
                t_s += step_s;
                z_um += (10.0 * volts - z_um) * (1.0 - (-step_s / LAG_S).exp());
                rows.push(Row {
                    t_s,
                    voltage_v: [volts; ACTUATORS],
                    z_um: Some(z_um + OFFSET_UM),
                    ..Row::default()
                });
            }
        }
        rows
    }

    /// By how much displacements were moved (um), and what is said of it.
    fn moved(mut rows: Vec<Row>, is_settled: bool) -> (f64, String) {
        let before = rows[0].z_um.expect("a reading");
        let mut notes = Vec::new();
        count_from(&mut rows, is_settled, &mut notes);
        (rows[0].z_um.expect("a reading") - before, notes.concat())
    }

    #[test]
    fn a_file_that_begins_at_rest_counts_from_there() {
        for holds in [[(0.0, 2e-4), (2.0, 0.1)], [(0.0, 0.1), (2.0, 0.1)]] {
            let (by_um, said) = moved(read(0.0, &holds, 2e-4), false);
            assert!((by_um + OFFSET_UM).abs() < 1e-9, "{by_um}");
            assert!(said.contains("its first reading at 0 V"), "{said}");
        }
    }

    #[test]
    fn after_a_drive_the_end_of_a_long_rest_tells_zero() {
        for holds in [&[(2.0, 0.1), (0.0, 0.1)][..], &[(0.0, 0.1), (2.0, 0.1)]] {
            let (by_um, said) = moved(read(2.0, holds, 2e-4), false);
            // 1e-4 of the 20 um that it went.
            assert!((by_um + OFFSET_UM).abs() < 2e-3, "{by_um}");
            assert!(said.contains("where it stands still at 0 V"), "{said}");
        }
    }

    #[test]
    fn while_it_cools_no_reading_tells_zero() {
        for (rest_s, step_s) in [(2e-4, 2e-4), (5e-3, 2e-4), (5e-3, 1e-5), (2e-4, 1e-5)] {
            for holds in [[(2.0, 0.1), (0.0, rest_s)], [(0.0, rest_s), (2.0, 0.1)]] {
                if holds[0].0 == 0.0 && rest_s == step_s {
                    continue;
                }
                let (by_um, said) = moved(read(2.0, &holds, step_s), false);
                assert_eq!(by_um, 0.0, "{rest_s} {step_s} {said}");
                assert!(said.contains("left as it is"), "{said}");
            }
        }
    }

    #[test]
    fn settled_rows_tell_it_at_any_rest() {
        let rows = read(2.0, &[(2.0, 1.0), (0.0, 1.0), (1.0, 1.0)], 1.0);
        let (by_um, said) = moved(rows.clone(), true);
        assert!((by_um + OFFSET_UM).abs() < 1e-9, "{said}");
        assert_eq!(moved(rows, false).0, 0.0);
    }

    #[test]
    fn what_a_meter_reads_of_no_drive_is_none() {
        let mut rows = read(0.0, &[(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)], 1.0);
        rows[0].voltage_v = [4e-4; ACTUATORS];
        let (by_um, said) = moved(rows, true);
        assert!((by_um + OFFSET_UM).abs() < 1e-9, "{said}");
    }

    #[test]
    fn without_a_rest_nothing_is_moved() {
        let (by_um, said) = moved(read(0.0, &[(1.0, 0.1), (2.0, 0.1)], 1e-2), false);
        assert_eq!(by_um, 0.0);
        assert!(said.contains("no displacement was read at 0 V"), "{said}");
    }
}
