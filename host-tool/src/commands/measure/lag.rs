//! The lag of the board's sensor: what it tells late is listened for after the drive's end, and taken out of what it read.
//!
//! Of another sensor the times at which it tells are moved (`sensor.rs`).

use experiment_player::{Piece, RowKind, ticks};
use measurement::{MeasurementFile, Row};
use quantities::Span;

/// A board's sensor that tells late what it reads.
#[derive(Debug)]
pub(super) struct Lag {
    pub(super) span: Span,
    /// What it told after the rows of a waveform (s, on the session's clock; um).
    after: Vec<(f64, Option<f64>)>,
}

/// From when on the samples of a waveform are no rows, and when the sensor has told all of them (ticks from its beginning).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tail {
    rows_end: i64,
    told: i64,
    /// So many samples more than the waveform's own are enough.
    pub(super) samples: u32,
}

impl Tail {
    /// Whether the sample at this tick is none of the waveform's own.
    pub(super) fn is_after(&self, tick: i64) -> bool {
        tick >= self.rows_end
    }

    /// Whether all has been told by this tick.
    pub(super) fn is_over(&self, tick: i64) -> bool {
        tick >= self.told
    }
}

impl Lag {
    pub(super) fn of(span: Span) -> Self {
        Self {
            span,
            after: Vec::new(),
        }
    }

    /// How long to listen for what is told late of this piece. At the end of a dwell the mirror rests, and what is read is what it is.
    pub(super) fn listening(&self, piece: &Piece, tick_hz: u32) -> Option<Tail> {
        if self.span.s == 0.0 || piece.rows == RowKind::EndOfDwell {
            return None;
        }
        let late = (self.span.s * f64::from(tick_hz)).ceil();
        let rows_end = ticks(&piece.waveform, tick_hz) as i64;
        Some(Tail {
            rows_end,
            told: rows_end + late as i64,
            samples: (late / f64::from(piece.stream.period_ticks)).ceil() as u32 + 1,
        })
    }

    /// This was told then, after the rows.
    pub(super) fn hear(&mut self, t_global_s: f64, z_um: Option<f64>) {
        self.after.push((t_global_s, z_um));
    }

    /// Gives each row the displacement that the sensor told so long after it, on a straight line between two readings; one for which there
    /// are none stays without.
    pub(super) fn take_out(&mut self, file: &mut MeasurementFile) {
        let after = std::mem::take(&mut self.after);
        if after.is_empty() {
            return;
        }
        let lag_s = self.span.s;
        file.keys.set("sensor_lag_s", &lag_s.to_string());
        let time_s = |row: &Row| row.t_global_s.unwrap_or(row.t_s);
        let rows = file.rows.iter().map(|row| (time_s(row), row.z_um));
        let mut told: Vec<(f64, Option<f64>)> = rows.chain(after).collect();
        told.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        for row in &mut file.rows {
            let at_s = time_s(row) + lag_s;
            let after = told.partition_point(|(t_s, _)| *t_s < at_s);
            let pair = after
                .checked_sub(1)
                .and_then(|before| told.get(before..=after));
            row.z_um = match pair {
                Some(&[(from_s, Some(from_um)), (to_s, Some(to_um))]) => {
                    Some(from_um + (at_s - from_s) / (to_s - from_s) * (to_um - from_um))
                }
                _ => None,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiment_player::pieces;
    use experiments::Experiment;
    use proptest::prelude::*;

    fn file(z_um: impl Iterator<Item = Option<f64>>) -> MeasurementFile {
        MeasurementFile {
            rows: z_um
                .enumerate()
                .map(|(index, z_um)| Row {
                    t_s: index as f64 * 1e-3,
                    z_um,
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        }
    }

    proptest! {
        /// A mirror that moves at a constant rate, seen late: what is told after the drive's end is of its last rows.
        #[test]
        fn a_late_sensor_comes_to_what_was(lag_ms in 0.1_f64..20.0, rate in -50.0_f64..50.0) {
            let was = |t_ms: f64| rate * t_ms;
            let mut lag = Lag::of(Span { s: lag_ms * 1e-3 });
            let read = |t_ms: u32| was(f64::from(t_ms) - lag_ms);
            let mut file = file((0..100).map(|t_ms| Some(read(t_ms))));
            for t_ms in 100..=100 + lag_ms.ceil() as u32 {
                lag.hear(f64::from(t_ms) * 1e-3, Some(read(t_ms)));
            }
            lag.take_out(&mut file);
            for row in &file.rows {
                let z_um = row.z_um.expect("it was told");
                prop_assert!((z_um - was(row.t_s * 1e3)).abs() < 1e-6);
            }
            let told_s = file.keys.get("sensor_lag_s").map(str::parse);
            prop_assert_eq!(told_s, Some(Ok(lag_ms * 1e-3)));
        }
    }

    #[test]
    fn nothing_is_made_of_a_missing_reading() {
        let mut late = file([Some(1.0), Some(2.0), None, Some(4.0), Some(5.0)].into_iter());
        let mut lag = Lag::of(Span { s: 0.5e-3 });
        lag.hear(5e-3, Some(6.0));
        lag.take_out(&mut late);
        let z_um: Vec<_> = late.rows.iter().map(|row| row.z_um).collect();
        assert_eq!([z_um[1], z_um[2]], [None; 2]);
        for (row, was) in [(0, 1.5), (3, 4.5), (4, 5.5)] {
            assert!((z_um[row].expect("it was told") - was).abs() < 1e-9);
        }
    }

    #[test]
    fn it_is_listened_for_as_long_as_the_sensor_is_late_and_not_at_rest() {
        let lag = Lag::of(Span { s: 20e-3 });
        let listening = |experiment: Experiment| {
            let piece = &pieces(&experiment, 10_000).expect("playable")[0];
            lag.listening(piece, 10_000)
        };
        let step = listening(Experiment::step(2.0, 0.3, 100.0)).expect("it moves");
        assert_eq!((step.told - step.rows_end, step.samples), (200, 3));
        let last = step.rows_end - 1;
        assert!(!step.is_after(last) && step.is_after(last + 1));
        assert!(!step.is_over(last + 200) && step.is_over(last + 201));
        assert_eq!(listening(Experiment::held(&[1.0, 2.0], 1.0)), None);
    }
}
