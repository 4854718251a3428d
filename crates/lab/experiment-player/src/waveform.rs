//! A run of an experiment as the waveform that the board plays: its shape, its table of points and its tilts, or why it has none.

use experiments::{Quantity, Run, Signal, Tilt};
use mirror_protocol::{Curve, POINTS, POSE_POINTS, Shape, Table, Triggers, Waveform};
use waveforms::FULL_SCALE;

/// The longest cycle of a wave (s): 100 h, as of a value that is held; four fifths of what a board's ticks count.
const LONGEST_CYCLE_S: f64 = 360_000.0;

/// Why a board cannot play an experiment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlayError {
    /// More values than its table holds.
    #[error("{count} values are more than the {most} that a board holds")]
    TooManyPoints {
        /// How many there are.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// A value lasts no tick, or too many.
    #[error("{asked_s} s are no time for a value: it takes {tick_s} s at least")]
    Dwell {
        /// What was asked for (s).
        asked_s: f64,
        /// One tick (s).
        tick_s: f64,
    },
    /// It is to be read more often than in every tick, or hardly ever.
    #[error("a board is read at {highest_hz} Hz at most, and not at {asked_hz} Hz")]
    Rate {
        /// What was asked for (Hz).
        asked_hz: f64,
        /// Every tick (Hz).
        highest_hz: f64,
    },
    /// It moves faster than a board can, or a cycle of it hardly ever ends.
    #[error(
        "a board moves at {highest_hz} Hz at most, a cycle in {LONGEST_CYCLE_S} s at least, and not at {asked_hz} Hz"
    )]
    Frequency {
        /// What was asked for (Hz).
        asked_hz: f64,
        /// A quarter of the ticks (Hz).
        highest_hz: f64,
    },
    /// A tilt goes another way through the cycle than the piston: one has a table, the other has none or a shorter one.
    #[error("a tilt with a table needs a position for each of its values, and one without none")]
    Tilts,
    /// It moves a stage.
    #[error("no board moves a stage")]
    Stage,
}

/// A run as the board plays it, with its table.
pub(crate) fn waveform(run: &Run, tick_hz: u32) -> Result<(Waveform, Vec<i16>), PlayError> {
    let (low, high) = run.signal.range();
    let (offset, amplitude) = ((low + high) / 2.0, (high - low) / 2.0);
    let most = match run.tilts {
        Some(_) => POSE_POINTS,
        None => POINTS,
    };
    let table = |values: &[f64], dwell_s: f64| {
        if values.len() > most {
            return Err(PlayError::TooManyPoints {
                count: values.len(),
                most,
            });
        }
        let dwell_ticks = (dwell_s * f64::from(tick_hz)).round();
        if !(1.0..=f64::from(u32::MAX)).contains(&dwell_ticks) {
            return Err(PlayError::Dwell {
                asked_s: dwell_s,
                tick_s: 1.0 / f64::from(tick_hz),
            });
        }
        Ok(Table {
            points: values.len() as u16,
            dwell_ticks: dwell_ticks as u32,
        })
    };
    let frequency = |asked_hz: f64| {
        let highest_hz = f64::from(tick_hz) / 4.0;
        if (1.0 / LONGEST_CYCLE_S..=highest_hz).contains(&asked_hz) {
            Ok(asked_hz as f32)
        } else {
            Err(PlayError::Frequency {
                asked_hz,
                highest_hz,
            })
        }
    };
    let (shape, offset, amplitude) = match &run.signal {
        Signal::Steps { values, dwell_s } => {
            (Shape::Steps(table(values, *dwell_s)?), offset, amplitude)
        }
        Signal::Lines { values, dwell_s } => {
            (Shape::Lines(table(values, *dwell_s)?), offset, amplitude)
        }
        Signal::Sine(wave) => {
            let frequency_hz = frequency(wave.frequency_hz)?;
            (Shape::Sine { frequency_hz }, wave.mean, wave.amplitude)
        }
        Signal::Triangle(wave) => {
            let frequency_hz = frequency(wave.frequency_hz)?;
            (Shape::Triangle { frequency_hz }, wave.mean, wave.amplitude)
        }
    };
    let mut points: Vec<i16> = match &run.signal {
        Signal::Steps { values, .. } | Signal::Lines { values, .. } => values
            .iter()
            .map(|v| point(*v, offset, amplitude))
            .collect(),
        Signal::Sine(_) | Signal::Triangle(_) => Vec::new(),
    };
    let quantity = match &run.tilts {
        Some(tilts) => mirror_protocol::Quantity::Pose {
            tilts: [
                tilt(&tilts[0], &run.signal, tick_hz, &mut points)?,
                tilt(&tilts[1], &run.signal, tick_hz, &mut points)?,
            ],
        },
        None => quantity(run.quantity)?,
    };
    let waveform = Waveform {
        quantity,
        shape,
        offset: offset as f32,
        amplitude: amplitude as f32,
        cycles: run.cycles,
        ends_off: true,
        triggers: Triggers {
            frames: run.begins.frames,
            lines: run.begins.lines,
        },
    };
    Ok((waveform, points))
}

/// A tilt beside a signal of the piston, with its column of the table where there is one.
fn tilt(
    tilt: &Tilt,
    signal: &Signal,
    tick_hz: u32,
    points: &mut Vec<i16>,
) -> Result<mirror_protocol::Tilt, PlayError> {
    let turning = matches!(signal, Signal::Sine(_) | Signal::Triangle(_));
    let (curve, turns) = match tilt {
        Tilt::Sine(turns) => (Curve::Sine, turns),
        Tilt::Triangle(turns) => (Curve::Triangle, turns),
        Tilt::Lines(values) => {
            let is_beside = matches!(signal, Signal::Steps { values: z_um, .. }
                | Signal::Lines { values: z_um, .. } if z_um.len() == values.len());
            if !is_beside {
                return Err(PlayError::Tilts);
            }
            let (low, high) = tilt.range();
            let (offset, amplitude) = ((low + high) / 2.0, (high - low) / 2.0);
            points.extend(values.iter().map(|v| point(*v, offset, amplitude)));
            return Ok(mirror_protocol::Tilt {
                offset: offset as f32,
                amplitude: amplitude as f32,
                ..mirror_protocol::Tilt::default()
            });
        }
    };
    if !turning {
        return Err(PlayError::Tilts);
    }
    let asked_hz = f64::from(turns.per_cycle) / signal.period_s();
    let highest_hz = f64::from(tick_hz) / 4.0;
    if asked_hz > highest_hz {
        return Err(PlayError::Frequency {
            asked_hz,
            highest_hz,
        });
    }
    Ok(mirror_protocol::Tilt {
        offset: turns.mean as f32,
        amplitude: turns.amplitude as f32,
        curve,
        turns: turns.per_cycle,
        // A whole turn is none.
        start: (turns.start.rem_euclid(1.0) * 65_536.0).round() as u32 as u16,
    })
}

fn quantity(quantity: Quantity) -> Result<mirror_protocol::Quantity, PlayError> {
    match quantity {
        Quantity::Position => Ok(mirror_protocol::Quantity::Position),
        Quantity::Voltage { active, others_v } => Ok(mirror_protocol::Quantity::Drive {
            active,
            others_v: others_v as f32,
        }),
        Quantity::StageHeight => Err(PlayError::Stage),
    }
}

/// A value as a point of the board's table.
fn point(value: f64, offset: f64, amplitude: f64) -> i16 {
    if amplitude > 0.0 {
        ((value - offset) / amplitude * f64::from(FULL_SCALE)).round() as i16
    } else {
        0
    }
}

/// How many ticks a waveform takes.
pub fn ticks(waveform: &Waveform, tick_hz: u32) -> u64 {
    let cycle = match waveform.shape {
        Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
            f64::from(tick_hz) / f64::from(frequency_hz)
        }
        Shape::Steps(table) => f64::from(table.points) * f64::from(table.dwell_ticks),
        Shape::Lines(table) => f64::from(table.points - 1) * f64::from(table.dwell_ticks),
    };
    (cycle * f64::from(waveform.cycles)).round() as u64
}
