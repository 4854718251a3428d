//! One waveform of an experiment as the board plays it, and which of its ticks are read.

use mirror_protocol::{POINTS, Quantity, Shape, Stream, Table, Waveform};
use waveforms::{FULL_SCALE, Pacer, Player};

use crate::error::ToolError;
use crate::quantity::Span;

/// A step is read every tick at first, then a twentieth of the time since the step later each time.
const SLOWING: u16 = 20;
/// A reading at the end of a dwell is the mean of so many ticks, as far as the dwell is long.
const MEAN_TICKS: u16 = 200;

/// A waveform that the board plays by itself, and what it samples meanwhile.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Time at 0 V before it, beyond the experiment's, which the experiment's own clock leaves out.
    pub(crate) rest_s: f64,
    pub(crate) waveform: Waveform,
    /// The board's table, where the waveform uses it.
    pub(crate) points: Vec<i16>,
    pub(crate) stream: Stream,
}

impl Run {
    /// Values one after the other, each read at its end.
    pub(crate) fn steps(
        values: &[f64],
        quantity: Quantity,
        dwell: Span,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        if values.len() > POINTS {
            return Err(ToolError::TooManyPoints {
                count: values.len(),
                most: POINTS,
            });
        }
        let dwell_ticks = (dwell.s * f64::from(tick_hz)).round();
        if !(1.0..=f64::from(u32::MAX)).contains(&dwell_ticks) {
            return Err(ToolError::Dwell {
                asked: dwell,
                tick: Span {
                    s: 1.0 / f64::from(tick_hz),
                },
            });
        }
        // A long dwell is sampled in several equal parts.
        let parts = (dwell_ticks / f64::from(u16::MAX)).ceil();
        let period_ticks = (dwell_ticks / parts).floor() as u16;
        let parts = parts as u32;
        let table = Table {
            points: values.len() as u16,
            dwell_ticks: u32::from(period_ticks) * parts,
        };
        let (offset, amplitude, points) = shares(values);
        Ok(Self {
            rest_s: 0.0,
            waveform: Waveform {
                quantity,
                shape: Shape::Steps(table),
                offset,
                amplitude,
                cycles: 1,
                ends_off: true,
            },
            points,
            stream: Stream {
                period_ticks,
                // The first is from before the waveform.
                count: u32::from(table.points) * parts + 1,
                mean_ticks: MEAN_TICKS.min(period_ticks / 4),
                slowing: 0,
            },
        })
    }

    /// The same, read every so many ticks after a step and then ever more slowly.
    pub(super) fn read_after_steps(mut self, period_ticks: u16, tick_hz: u32) -> Self {
        self.stream = Stream {
            period_ticks,
            mean_ticks: 1,
            slowing: SLOWING,
            count: u32::MAX,
        };
        self.stream.count = self.samples(tick_hz);
        self
    }

    /// How many samples the stream brings until the waveform is over.
    fn samples(&self, tick_hz: u32) -> u32 {
        let Ok(mut player) = Player::new(self.waveform, tick_hz) else {
            return 0;
        };
        let mut pacer = Pacer::new(self.stream);
        let (mut count, mut last, mut stepped) = (0, None, false);
        while !player.is_over() {
            count += u32::from(pacer.tick(stepped).sample);
            let value = player.next(|index| self.points[index]);
            stepped = last != Some(value);
            last = Some(value);
        }
        count
    }
}

/// How long a waveform takes.
pub(super) fn ticks(waveform: &Waveform, tick_hz: u32) -> u64 {
    let cycle = match waveform.shape {
        Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
            f64::from(tick_hz) / f64::from(frequency_hz)
        }
        Shape::Steps(table) => f64::from(table.points) * f64::from(table.dwell_ticks),
        Shape::Lines(table) => f64::from(table.points - 1) * f64::from(table.dwell_ticks),
    };
    (cycle * f64::from(waveform.cycles)).round() as u64
}

/// Values as a waveform's offset, amplitude and points.
pub(crate) fn shares(values: &[f64]) -> (f32, f32, Vec<i16>) {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
    let (offset, amplitude) = ((low + high) / 2.0, (high - low) / 2.0);
    let share = |value: &f64| {
        if amplitude > 0.0 {
            ((value - offset) / amplitude * f64::from(FULL_SCALE)).round() as i16
        } else {
            0
        }
    };
    (
        offset as f32,
        amplitude as f32,
        values.iter().map(share).collect(),
    )
}
