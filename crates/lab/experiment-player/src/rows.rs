//! From the board's samples to the rows of a measurement file.

use measurement::Row;
use mirror_protocol::{Quantity, Shape, Telemetry, Triggers};
use waveforms::FULL_SCALE;

use crate::piece::{Piece, RowKind};

/// One code of the drive (V): 4250 counts are 4.25 V (`docs/board.md`). What is driven on average lies within one of every
/// tick's code.
const CODE_V: f64 = 1e-3;

/// The number that the board meant: the shortest decimal that is this `f32`, without the digits that a wider type would
/// show behind it.
pub fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Where a run lies in its file and its session.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// The board's control ticks a second.
    pub tick_hz: u32,
    /// The tick at which the session began.
    pub session_tick: u32,
    /// The first tick in which the run's waveform was driven.
    pub first_tick: u32,
    /// Time of the file's rows before this run.
    pub passed_s: f64,
}

impl Clock {
    fn seconds(&self, from: u32, to: u32) -> f64 {
        // A sample of just before the start is before 0.
        f64::from(to.wrapping_sub(from) as i32) / f64::from(self.tick_hz)
    }

    fn row(&self, sample: &Telemetry) -> Row {
        Row {
            t_s: self.passed_s + self.seconds(self.first_tick, sample.tick),
            t_global_s: Some(
                f64::from(sample.tick.wrapping_sub(self.session_tick)) / f64::from(self.tick_hz),
            ),
            voltage_v: sample.drive_v.map(decimal),
            current_a: sample.current_a.map(|current| Some(decimal(current))),
            z_um: sample.sensor_z_um.map(decimal).filter(|um| um.is_finite()),
            ..Row::default()
        }
    }
}

/// The rows of one run. Its first sample is from before the waveform and gives none.
///
/// The sensor is read as a tick begins, the currents while the tick's own voltages are driven. A row
/// states the drive up to its time, so:
/// - at the end of a dwell, where a sample is a mean, the voltage is the mean, too: the dwell's own, between the two codes that
///   the board takes in turns;
/// - at a step, a row has the voltage of before, and no currents;
/// - what of a waveform with triggers began since the row before is in every row;
/// - along a curve the voltage is the one between two ticks, and the currents are those which the
///   sensed resistances have at it; where the position jumps, the voltage is the one of before.
pub fn rows(samples: &[Telemetry], piece: &Piece, clock: &Clock) -> Vec<Row> {
    let kind = piece.rows;
    let tells_triggers = piece.waveform.triggers != Triggers::default();
    samples
        .windows(2)
        .filter(|pair| {
            let curved = matches!(kind, RowKind::Curve | RowKind::Jumps { .. });
            pair[1].tick != clock.first_tick || curved
        })
        .map(|pair| {
            let (before, now) = (&pair[0], &pair[1]);
            let mut row = clock.row(now);
            row.trigger = tells_triggers.then(|| now.trigger.bits());
            match kind {
                RowKind::EndOfDwell => {
                    let dwell = piece.held_v(now.tick.wrapping_sub(clock.first_tick));
                    for (volts, mean) in row.voltage_v.iter_mut().zip(dwell) {
                        *volts = mean
                            .filter(|mean| (mean - *volts).abs() < CODE_V)
                            .unwrap_or(*volts);
                    }
                }
                RowKind::AfterSteps => {
                    if before.drive_v != now.drive_v {
                        row.voltage_v = before.drive_v.map(decimal);
                        row.current_a = [None; 4];
                    }
                }
                RowKind::Jumps { dwell_ticks }
                    if now
                        .tick
                        .wrapping_sub(clock.first_tick)
                        .is_multiple_of(dwell_ticks) =>
                {
                    row.voltage_v = before.drive_v.map(decimal);
                    row.current_a = [None; 4];
                }
                RowKind::Curve | RowKind::Jumps { .. } => {
                    let ticks = f64::from(now.tick.wrapping_sub(before.tick));
                    for channel in 0..4 {
                        let (from, to) = (decimal(before.drive_v[channel]), row.voltage_v[channel]);
                        let between = to - 0.5 / ticks * (to - from);
                        row.current_a[channel] = row.current_a[channel]
                            .filter(|_| to > 0.0)
                            .map(|current| current * between / to);
                        row.voltage_v[channel] = between;
                    }
                }
            }
            row
        })
        .collect()
}

impl Piece {
    /// What each channel is to be driven with, this many ticks after the first, where voltages step (V).
    fn held_v(&self, ticks: u32) -> [Option<f64>; 4] {
        let (Shape::Steps(table), Quantity::Drive { active, others_v }) =
            (self.waveform.shape, self.waveform.quantity)
        else {
            return [None; 4];
        };
        let step = ticks / table.dwell_ticks % u32::from(table.points);
        let share = f32::from(self.points[step as usize]) / f32::from(FULL_SCALE);
        let volts = self.waveform.offset + self.waveform.amplitude * share;
        active.map(|moves| Some(decimal(if moves { volts } else { others_v })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::piece::pieces;
    use experiments::Experiment;

    const CLOCK: Clock = Clock {
        tick_hz: 10_000,
        session_tick: 1000,
        first_tick: 11_000,
        passed_s: 0.0,
    };

    fn sample(tick: u32, volts: f32, z_um: f32) -> Telemetry {
        Telemetry {
            tick,
            drive_v: [volts; 4],
            current_a: [volts / 400.0; 4],
            sensor_z_um: Some(z_um),
            ..Telemetry::default()
        }
    }

    /// Two dwells of a second, whose rows are made like this.
    fn two_dwells(rows: RowKind) -> Piece {
        let held = Experiment::held(&[1.0, 2.0], 1.0);
        let pieces = pieces(&held, CLOCK.tick_hz).expect("playable");
        Piece {
            rows,
            ..pieces[0].clone()
        }
    }

    #[test]
    fn the_last_tick_of_a_dwell_has_its_own_drive() {
        let samples = [
            sample(10_999, 0.0, 0.0),
            sample(20_999, 1.0, 26.0),
            sample(30_999, 2.0, 90.0),
        ];
        let rows = rows(&samples, &two_dwells(RowKind::EndOfDwell), &CLOCK);
        let told: Vec<_> = rows
            .iter()
            .map(|row| (row.t_s, row.t_global_s, row.voltage_v[0], row.z_um))
            .collect();
        assert_eq!(
            told,
            [
                (0.9999, Some(1.9999), 1.0, Some(26.0)),
                (1.9999, Some(2.9999), 2.0, Some(90.0))
            ]
        );
    }

    /// A mean of 1 V is made of ticks of 1 V and of 1.001 V; a board that limits a drive does not make it.
    #[test]
    fn a_mean_has_the_drive_s_mean_and_a_limited_drive_stays() {
        let samples = [
            sample(10_999, 0.0, 0.0),
            sample(20_999, 1.001, 26.0),
            sample(30_999, 1.9, 80.0),
        ];
        let made = rows(&samples, &two_dwells(RowKind::EndOfDwell), &CLOCK);
        let drives: Vec<_> = made.iter().map(|row| row.voltage_v[2]).collect();
        // The table has 16 bits from 1 V to 2 V.
        assert!(
            (drives[0] - 1.0).abs() < 2e-5 && drives[1] == 1.9,
            "{drives:?}"
        );
    }

    #[test]
    fn at_a_step_the_drive_is_still_the_old_one() {
        let samples = [
            sample(10_999, 0.0, 0.0),
            sample(11_000, 2.0, 0.0),
            sample(11_002, 2.0, 5.0),
            sample(11_010, 0.0, 30.0),
            sample(11_012, 0.0, 20.0),
        ];
        let rows = rows(&samples, &two_dwells(RowKind::AfterSteps), &CLOCK);
        let drives: Vec<_> = rows
            .iter()
            .map(|row| (row.voltage_v[0], row.current_a[0].is_some()))
            .collect();
        assert_eq!(drives, [(2.0, true), (2.0, false), (0.0, true)]);
    }

    #[test]
    fn along_a_curve_drive_and_current_are_those_between_two_ticks() {
        let samples = [
            sample(10_999, 1.0, 26.0),
            sample(11_000, 1.1, 26.0),
            sample(11_001, 1.3, 27.0),
        ];
        let rows = rows(&samples, &two_dwells(RowKind::Curve), &CLOCK);
        let volts: Vec<f64> = rows.iter().map(|row| row.voltage_v[2]).collect();
        assert!((volts[0] - 1.05).abs() < 1e-6 && (volts[1] - 1.2).abs() < 1e-6);
        let ohms = rows[1].voltage_v[0] / rows[1].current_a[0].unwrap();
        // f32 keeps 6e-8 of voltage and current each.
        assert!((ohms - 400.0).abs() < 1e-4, "{ohms}");
        assert_eq!(rows[0].t_s, 0.0);
    }
}
