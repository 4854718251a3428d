//! Runs of a table: a time that begins anew begins another one.

use std::ops::Range;

use super::assignment::Assignment;
use super::error::ImportError;
use super::table::Table;
use crate::column::Column;

/// A run has so many rows at least, and goes back behind as many of those before it. Fewer are rows out of order, as two loggers
/// of one clock write them: a choice.
const FEWEST: usize = 3;

/// That a table holds several runs, which no order of their times puts right.
pub(super) fn check(table: &Table, assignments: &[Assignment]) -> Result<(), ImportError> {
    let runs = runs(&times(table, assignments));
    if runs.len() < 2 {
        return Ok(());
    }
    let sizes: Vec<String> = runs.iter().map(|run| run.len().to_string()).collect();
    Err(ImportError::new(
        format!(
            "the time begins anew in row {} of the table, which holds {} runs, of {} rows",
            runs[1].start + 1,
            runs.len(),
            sizes.join(", ")
        ),
        "import each run into a file of its own, the first with --run 1; the files together are one session",
    ))
}

impl Table {
    /// The run of this number, from 1, alone.
    ///
    /// # Errors
    /// Where there is none.
    pub fn run(mut self, assignments: &[Assignment], number: usize) -> Result<Self, ImportError> {
        let runs = runs(&times(&self, assignments));
        let run = number.checked_sub(1).and_then(|index| runs.get(index));
        let Some(run) = run.cloned() else {
            return Err(ImportError::new(
                format!("there is no run {number}: the table holds {}", runs.len()),
                "runs count from 1, and another one begins where the time does",
            ));
        };
        self.rows.truncate(run.end);
        self.rows.drain(..run.start);
        Ok(self)
    }
}

fn times(table: &Table, assignments: &[Assignment]) -> Vec<Option<f64>> {
    let time = assignments.iter().find(|a| a.column == Column::Time);
    let of_row = |row: &Vec<Option<f64>>| time.and_then(|time| row[time.source]);
    table.rows.iter().map(of_row).collect()
}

/// The runs of rows with these times; one where none begins anew. Rows without a time belong to those before.
fn runs(times: &[Option<f64>]) -> Vec<Range<usize>> {
    let known: Vec<(usize, f64)> = (0..)
        .zip(times)
        .filter_map(|(row, t)| Some((row, (*t)?)))
        .collect();
    let mut starts = vec![0];
    let mut before = Before::default();
    for rising in known.chunk_by(|a, b| a.1 <= b.1) {
        let [(row, first), .., (_, last)] = rising else {
            before.add(rising);
            continue;
        };
        if rising.len() >= FEWEST && before.is_behind(*first, *last) {
            starts.push(*row);
            before = Before::default();
        }
        before.add(rising);
    }
    let ends = starts[1..].iter().copied().chain([times.len()]);
    starts
        .iter()
        .copied()
        .zip(ends)
        .map(|(start, end)| start..end)
        .collect()
}

/// The times of a run so far.
struct Before {
    earliest: f64,
    /// The latest ones, the last one first.
    latest: [f64; FEWEST],
}

impl Default for Before {
    fn default() -> Self {
        Self {
            earliest: f64::INFINITY,
            latest: [f64::NEG_INFINITY; FEWEST],
        }
    }
}

impl Before {
    fn add(&mut self, rows: &[(usize, f64)]) {
        for &(_, time) in rows {
            self.earliest = self.earliest.min(time);
            let place = self.latest.iter().position(|one| time >= *one);
            if let Some(place) = place {
                self.latest[place..].rotate_right(1);
                self.latest[place] = time;
            }
        }
    }

    /// Whether rows from one time to another go back behind these. Those that end before any of them are of the same run, newest
    /// rows first.
    fn is_behind(&self, from: f64, to: f64) -> bool {
        from <= self.latest[FEWEST - 1] && to > self.earliest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_begins_anew_begins_another_run() {
        for (times, starts) in [
            (&[0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0][..], &[0, 4][..]),
            // The second run is a short one between two rows of the first.
            (&[0.0, 10.0, 20.0, 30.0, 3.0, 4.0, 5.0], &[0, 4]),
            (&[0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0], &[0, 3, 6]),
            // Rows out of order, the newest first, and in blocks.
            (&[0.0, 2.0, 1.0, 3.0, 5.0, 4.0, 6.0], &[0]),
            (&[5.0, 4.0, 3.0, 2.0, 1.0], &[0]),
            (&[6.0, 7.0, 8.0, 3.0, 4.0, 5.0, 0.0, 1.0, 2.0], &[0]),
            (&[1.0, 1.0, 1.0, 1.0, 2.0], &[0]),
            (&[], &[0]),
        ] {
            let times: Vec<_> = times.iter().copied().map(Some).collect();
            let found: Vec<_> = runs(&times).into_iter().map(|run| run.start).collect();
            assert_eq!(found, starts, "{times:?}");
        }
    }
}
