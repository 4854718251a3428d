//! One waveform of an experiment as the board plays it, and which of its ticks are sampled.

use experiments::instruments::MEAN_S;
use experiments::{Experiment, Quantity, Reading, Run, SLOWING};
use mirror_protocol::{Shape, Stream, Table, Waveform};
use waveforms::{Pacer, Player};

use crate::waveform::{PlayError, ticks, waveform};

/// What rows samples make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowKind {
    /// Of the last tick of every dwell, or of equal parts of it.
    EndOfDwell,
    /// Of a drive that steps.
    AfterSteps,
    /// Along a smooth drive, or the drives that the board makes of a position.
    Curve,
    /// Along the drives that the board makes of positions that jump.
    Jumps {
        /// From jump to jump.
        dwell_ticks: u32,
    },
}

/// A waveform that the board plays by itself, and what it samples meanwhile.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Time at 0 V before it, beyond the experiment's (s), which the experiment's own clock leaves out.
    pub rest_s: f64,
    /// What is played; all channels are off after it.
    pub waveform: Waveform,
    /// The board's table, where the waveform uses it.
    pub points: Vec<i16>,
    /// Which ticks are sampled; the first sample is from before the waveform.
    pub stream: Stream,
    /// What rows its samples make.
    pub rows: RowKind,
}

/// What a board of `tick_hz` control ticks a second plays for `experiment`, one after the other.
///
/// # Errors
/// Where it cannot.
pub fn pieces(experiment: &Experiment, tick_hz: u32) -> Result<Vec<Piece>, PlayError> {
    let piece = |run| Piece::new(run, experiment.reading, tick_hz);
    experiment.runs.iter().map(piece).collect()
}

impl Piece {
    fn new(run: &Run, reading: Reading, tick_hz: u32) -> Result<Self, PlayError> {
        let (waveform, points) = waveform(run, tick_hz)?;
        let mut piece = Self {
            rest_s: run.rest_s,
            waveform,
            points,
            stream: Stream::default(),
            rows: RowKind::EndOfDwell,
        };
        let moves_positions = run.quantity == Quantity::Position;
        match (reading, waveform.shape) {
            (Reading::AfterSteps { rate_hz }, Shape::Steps(table)) => {
                piece.stream = piece.after_steps(rate_hz, tick_hz)?;
                piece.rows = if moves_positions {
                    RowKind::Jumps {
                        dwell_ticks: table.dwell_ticks,
                    }
                } else {
                    RowKind::AfterSteps
                };
            }
            (Reading::EndOfDwell, Shape::Steps(table)) => {
                (piece.waveform, piece.stream) = piece.at_the_end_of_dwells(table, tick_hz);
            }
            (Reading::Evenly { readings }, _) => {
                piece.stream = evenly(&waveform, readings, tick_hz);
                piece.rows = RowKind::Curve;
            }
            (Reading::AfterSteps { .. } | Reading::EndOfDwell, _) => {
                piece.stream = evenly(&waveform, u32::MAX, tick_hz);
                piece.rows = RowKind::Curve;
            }
        }
        Ok(piece)
    }

    /// A long dwell is sampled in several equal parts.
    fn at_the_end_of_dwells(&self, table: Table, tick_hz: u32) -> (Waveform, Stream) {
        let parts = table.dwell_ticks.div_ceil(u16::MAX.into());
        let period_ticks = (table.dwell_ticks / parts) as u16;
        let waveform = Waveform {
            shape: Shape::Steps(Table {
                dwell_ticks: u32::from(period_ticks) * parts,
                ..table
            }),
            ..self.waveform
        };
        let mean_ticks = (MEAN_S * f64::from(tick_hz)) as u16;
        let stream = Stream {
            period_ticks,
            count: u32::from(table.points) * parts * waveform.cycles + 1,
            mean_ticks: mean_ticks.min(period_ticks / 4),
            slowing: 0,
        };
        (waveform, stream)
    }

    fn after_steps(&self, rate_hz: f64, tick_hz: u32) -> Result<Stream, PlayError> {
        let period = if rate_hz.is_finite() {
            (f64::from(tick_hz) / rate_hz).round()
        } else {
            1.0
        };
        if !(1.0..=f64::from(u16::MAX)).contains(&period) {
            return Err(PlayError::Rate {
                asked_hz: rate_hz,
                highest_hz: tick_hz.into(),
            });
        }
        let endless = Stream {
            period_ticks: period as u16,
            mean_ticks: 1,
            slowing: SLOWING,
            count: u32::MAX,
        };
        Ok(Stream {
            count: self.samples(endless, tick_hz),
            ..endless
        })
    }

    /// How many samples a stream brings until the waveform is over.
    fn samples(&self, stream: Stream, tick_hz: u32) -> u32 {
        let Ok(mut player) = Player::new(self.waveform, tick_hz) else {
            return 0;
        };
        let mut pacer = Pacer::new(stream);
        let (mut count, mut last, mut stepped) = (0, None, false);
        while !player.is_over() {
            count += u32::from(pacer.tick(stepped).sample);
            let played = player.next(|index| self.points[index]);
            let value = Some((played.value, played.tilts));
            stepped = last != value;
            last = value;
        }
        count
    }
}

/// Every so many ticks, so that there are at most so many readings.
fn evenly(waveform: &Waveform, readings: u32, tick_hz: u32) -> Stream {
    let ticks = ticks(waveform, tick_hz);
    let period = ticks.div_ceil(readings.max(1).into());
    let period = period.clamp(1, u16::MAX.into());
    Stream {
        period_ticks: period as u16,
        count: (ticks / period) as u32 + 1,
        mean_ticks: 1,
        slowing: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiments::{Signal, Tilt, Turns, Wave, calibration, session};
    use mirror_protocol::POINTS;

    const TICK_HZ: u32 = 10_000;

    /// What the board wants in each tick.
    fn played(piece: &Piece) -> Vec<f64> {
        let mut player = Player::new(piece.waveform, TICK_HZ).expect("playable");
        let mut values = Vec::new();
        while !player.is_over() {
            values.push(player.next(|index| piece.points[index]).value.into());
        }
        values
    }

    /// Every tick of everything that is measured and moved is what the experiment says, in the middle of the tick.
    #[test]
    fn a_board_plays_what_the_experiments_say() {
        let effort = calibration::Effort::QUICK;
        let moves = calibration::moves(&effort, 170.0);
        let trial = calibration::Trial::new(&effort, 170.0).experiments();
        for experiment in session(3.5).into_iter().chain(moves).chain(trial) {
            let pieces = pieces(&experiment, TICK_HZ).expect("playable");
            for (run, piece) in experiment.runs.iter().zip(&pieces) {
                let values = played(piece);
                let asked_s = run.duration_s();
                let played_s = values.len() as f64 / f64::from(TICK_HZ);
                // The board's phase has 32 bits: so much a frequency may be off.
                let off_hz = f64::from(TICK_HZ) / 4_294_967_296.0;
                let off_s = 1e-4 + asked_s * off_hz * run.signal.period_s();
                assert!((asked_s - played_s).abs() < off_s, "{}", experiment.name);
                let (low, high) = run.signal.range();
                for (tick, value) in values.iter().enumerate() {
                    let t_s = (tick as f64 + 0.5) / f64::from(TICK_HZ);
                    let asked = run.signal.at(t_s);
                    // A table has 16 bits from end to end, a sine a series in f32, and a triangle the steepest way.
                    let close = (high - low) * (3e-5 + 4.0 * off_hz * t_s) + 1e-5;
                    assert!(
                        (value - asked).abs() < close,
                        "{} at {t_s} s: {value} for {asked}",
                        experiment.name
                    );
                }
            }
        }
    }

    /// Tilts too, of both kinds.
    #[test]
    fn a_board_plays_the_tilts_beside_the_piston() {
        let turns = |start| Turns {
            mean: 0.001,
            amplitude: 0.002,
            per_cycle: 3,
            start,
        };
        let wave = Wave {
            mean: 80.0,
            amplitude: 5.0,
            frequency_hz: 2.0,
        };
        let turning = Run {
            tilts: Some([Tilt::Sine(turns(0.25)), Tilt::Triangle(turns(0.75))]),
            ..Run::along(Signal::Triangle(wave), 2)
        };
        let lines = Signal::Lines {
            values: vec![60.0, 80.0, 70.0],
            dwell_s: 0.1,
        };
        let along = |x: Vec<f64>| Run {
            tilts: Some([Tilt::Lines(x), Tilt::Lines(vec![0.0; 3])]),
            ..Run::along(lines.clone(), 2)
        };
        for run in [turning, along(vec![0.001, -0.002, 0.003])] {
            let experiment = Experiment::scan("scan", run.clone(), 100);
            let piece = &pieces(&experiment, TICK_HZ).expect("playable")[0];
            let mut player = Player::new(piece.waveform, TICK_HZ).expect("playable");
            let mut tick = 0.0;
            while !player.is_over() {
                let played = player.next(|index| piece.points[index]);
                let asked = run.tilts_at((tick + 0.5) / f64::from(TICK_HZ));
                for (tilt, asked) in played.tilts.into_iter().zip(asked) {
                    // A table has 16 bits from end to end, and f32 and its sine a few bits fewer than 24.
                    assert!(
                        (f64::from(tilt) - asked).abs() < 2e-7,
                        "{tick}: {tilt} for {asked}"
                    );
                }
                tick += 1.0;
            }
        }
        let told = |run| pieces(&Experiment::scan("scan", run, 100), TICK_HZ).map(drop);
        assert_eq!(told(along(vec![0.0; 2])), Err(PlayError::Tilts));
        let beside_a_table = Run {
            tilts: Some([Tilt::Sine(turns(0.0)), Tilt::Sine(turns(0.0))]),
            ..Run::along(lines.clone(), 1)
        };
        assert_eq!(told(beside_a_table), Err(PlayError::Tilts));
    }

    #[test]
    fn it_is_read_as_often_as_the_experiment_says() {
        for experiment in session(3.5) {
            let dwells = experiment.dwells().expect("drives").len();
            let pieces = pieces(&experiment, TICK_HZ).expect("playable");
            let samples: u32 = pieces.iter().map(|piece| piece.stream.count - 1).sum();
            // Whole ticks make the waits after a step a little longer or shorter.
            let many = if experiment.name == "step" { 40 } else { 0 };
            let apart = (samples as usize).abs_diff(dwells);
            assert!(apart <= many, "{}: {samples} for {dwells}", experiment.name);
        }
    }

    #[test]
    fn what_a_board_cannot_play_is_told() {
        let told = |experiment: Experiment| pieces(&experiment, TICK_HZ).map(drop);
        let many = vec![1.0; POINTS + 1];
        assert_eq!(
            told(Experiment::held(&many, 1.0)),
            Err(PlayError::TooManyPoints {
                count: POINTS + 1,
                most: POINTS
            })
        );
        assert_eq!(
            told(Experiment::held(&[1.0], 1e-5)),
            Err(PlayError::Dwell {
                asked_s: 1e-5,
                tick_s: 1e-4
            })
        );
        assert_eq!(
            told(Experiment::step(1.0, 1.0, 1e5)),
            Err(PlayError::Rate {
                asked_hz: 1e5,
                highest_hz: 1e4
            })
        );
        assert_eq!(
            told(Experiment::sine(1.0, 0.5, 3e3, 1)),
            Err(PlayError::Frequency {
                asked_hz: 3e3,
                highest_hz: 2500.0
            })
        );
        // A cycle in 11 days, and one in 28 h.
        let is_refused = |hz| {
            let told = told(Experiment::sine(1.0, 0.5, hz, 1));
            matches!(told, Err(PlayError::Frequency { .. }))
        };
        assert_eq!([1e-6, 1e-5].map(is_refused), [true, false]);
        assert_eq!(
            told(Experiment::reference(&[0.0], 1.0)),
            Err(PlayError::Stage)
        );
    }
}
