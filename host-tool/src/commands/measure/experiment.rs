//! What is measured: waveforms for the board, and which of its ticks are read.
//!
//! Numbers and names are those of the paper's procedures; a session is what a fit and a diagnosis want.

use mirror_protocol::{Quantity, Shape, Stream, Waveform};
use waveforms::Player;

use super::play::{Run, ticks};
use crate::error::ToolError;
use crate::quantity::{Frequency, Span, Voltage};
use crate::report::decimal;

/// Readings a cycle of a sine.
const READINGS_PER_CYCLE: f64 = 100.0;
/// Voltage at which idle actuators are sensed.
const SENSE_BIAS_V: f32 = 0.2;
/// Before a sine its mean is held, so that the mirror is warm.
const PREHOLD_S: f64 = 5.0;
/// Instead of a formula where the board makes the drive: the measurement files' word for it.
const POSITION: &str = "position";
/// All four actuators alike.
const TOGETHER: Quantity = Quantity::Drive {
    active: [true; 4],
    others_v: 0.0,
};

/// One experiment: one measurement file.
#[derive(Clone, Debug)]
pub(crate) struct Experiment {
    /// `sweep`, `step`, `sine_20`, ...
    pub(crate) name: String,
    /// Time at 0 V before it, at least.
    pub(crate) rest_s: f64,
    /// Voltage held on all actuators just before it, and for how long at least.
    pub(crate) prehold: Option<(f64, f64)>,
    /// The formula of the drive, for sines.
    pub(crate) drive: Option<String>,
    /// Which ticks are read.
    pub(crate) reading: Reading,
    /// Waveforms, one after the other.
    pub(crate) runs: Vec<Run>,
}

/// How samples become rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// The last tick of every dwell, or of equal parts of it.
    EndOfDwell,
    /// Ever more slowly after every step.
    AfterSteps,
    /// Evenly along a smooth drive.
    Curve,
    /// Ever more slowly after every jump of the position, along the drives that the board makes of it.
    Moves {
        /// From jump to jump.
        dwell_ticks: u32,
    },
}

impl Experiment {
    /// All actuators up to `max` in `steps` equal steps and down again, so often.
    pub(crate) fn sweep(
        max: Voltage,
        steps: u32,
        dwell: Span,
        repeat: u32,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let volts = |step: u32| max.v * f64::from(step) / f64::from(steps);
        let ladder: Vec<f64> = (0..=steps).chain((0..steps).rev()).map(volts).collect();
        let mut run = Run::steps(&ladder, TOGETHER, dwell, tick_hz)?;
        run.stream.count = (run.stream.count - 1) * repeat + 1;
        run.waveform.cycles = repeat;
        Ok(Self::of("sweep", Reading::EndOfDwell, vec![run]))
    }

    /// These voltages on all actuators, one after the other, read at the end of each dwell.
    pub(crate) fn held(volts: &[Voltage], dwell: Span, tick_hz: u32) -> Result<Self, ToolError> {
        let volts: Vec<f64> = volts.iter().map(|volts| volts.v).collect();
        let run = Run::steps(&volts, TOGETHER, dwell, tick_hz)?;
        Ok(Self::of("held", Reading::EndOfDwell, vec![run]))
    }

    /// All actuators to `to` and back to 0 after `hold`, read at most at `rate`.
    pub(crate) fn step(
        to: Voltage,
        hold: Span,
        rate: Frequency,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let run = Run::steps(&[to.v, 0.0], TOGETHER, hold, tick_hz)?;
        let period = (f64::from(tick_hz) / rate.hz).round();
        if !(1.0..=f64::from(u16::MAX)).contains(&period) {
            return Err(ToolError::Rate {
                asked: rate,
                highest: Frequency { hz: tick_hz.into() },
            });
        }
        let run = run.read_after_steps(period as u16, tick_hz);
        Ok(Self::of("step", Reading::AfterSteps, vec![run]))
    }

    /// `mean` plus a sine of `amplitude` on all actuators, which are warm before it begins.
    pub(crate) fn sine(
        mean: Voltage,
        amplitude: Voltage,
        frequency: Frequency,
        cycles: u32,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let period_s = 1.0 / frequency.hz;
        let period_ticks = (f64::from(tick_hz) * period_s / READINGS_PER_CYCLE).round();
        if period_ticks > f64::from(u16::MAX) || frequency.hz > f64::from(tick_hz) / 4.0 {
            return Err(ToolError::Frequency {
                asked: frequency,
                highest: Frequency {
                    hz: f64::from(tick_hz) / 4.0,
                },
            });
        }
        let period_ticks = (period_ticks as u16).max(1);
        let ticks = f64::from(tick_hz) * period_s * f64::from(cycles);
        let run = Run {
            rest_s: 0.0,
            waveform: Waveform {
                quantity: TOGETHER,
                shape: Shape::Sine {
                    frequency_hz: frequency.hz as f32,
                },
                offset: mean.v as f32,
                amplitude: amplitude.v as f32,
                cycles,
                ends_off: true,
            },
            points: Vec::new(),
            stream: Stream {
                period_ticks,
                count: (ticks / f64::from(period_ticks)).floor() as u32 + 1,
                mean_ticks: 1,
                slowing: 0,
            },
        };
        let name = format!("sine_{}", frequency.hz).replace('.', "p");
        Ok(Self {
            prehold: Some((mean.v, PREHOLD_S)),
            drive: Some(format!("{}+{}*sin(2*pi*f*t)", mean.v, amplitude.v)),
            ..Self::of(&name, Reading::Curve, vec![run])
        })
    }

    /// Each actuator alone up to `max` in `steps` steps, the others at a sense bias, at rest in between.
    pub(crate) fn single(
        max: Voltage,
        steps: u32,
        dwell: Span,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let volts: Vec<f64> = (0..=steps)
            .map(|step| max.v * f64::from(step) / f64::from(steps))
            .collect();
        let alone = |actuator: usize| {
            let mut active = [false; 4];
            active[actuator] = true;
            let quantity = Quantity::Drive {
                active,
                others_v: SENSE_BIAS_V,
            };
            let mut run = Run::steps(&volts, quantity, dwell, tick_hz)?;
            run.rest_s = if actuator == 0 { 0.0 } else { 2.0 };
            Ok(run)
        };
        let runs = (0..4).map(alone).collect::<Result<_, ToolError>>()?;
        Ok(Self::of("single", Reading::EndOfDwell, runs))
    }

    /// Positions one after the other, read at the end of each dwell.
    pub(crate) fn positions(
        name: &str,
        z_um: &[f64],
        dwell: Span,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let run = Run::steps(z_um, Quantity::Position, dwell, tick_hz)?;
        Ok(Self::of(name, Reading::EndOfDwell, vec![run]))
    }

    /// Positions one after the other, read at every tick after a step and then ever more slowly.
    pub(crate) fn position_steps(
        name: &str,
        z_um: &[f64],
        hold: Span,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let run = Run::steps(z_um, Quantity::Position, hold, tick_hz)?;
        let run = run.read_after_steps(1, tick_hz);
        Ok(Self::of(name, Reading::AfterSteps, vec![run]))
    }

    /// Positions one after the other, read at every tick after a jump and then ever more slowly, with the drives and
    /// currents that belong to the readings.
    pub(crate) fn moves(
        name: &str,
        z_um: &[f64],
        hold: Span,
        tick_hz: u32,
    ) -> Result<Self, ToolError> {
        let run = Run::steps(z_um, Quantity::Position, hold, tick_hz)?;
        let reading = match run.waveform.shape {
            Shape::Steps(table) => Reading::Moves {
                dwell_ticks: table.dwell_ticks,
            },
            _ => Reading::Curve,
        };
        let run = run.read_after_steps(1, tick_hz);
        Ok(Self::of(name, reading, vec![run]).along_a_position())
    }

    /// The same, with the drives and currents that belong to the readings.
    pub(crate) fn along_a_position(self) -> Self {
        let reading = match self.reading {
            Reading::EndOfDwell => Reading::Curve,
            other => other,
        };
        Self {
            drive: Some(POSITION.into()),
            reading,
            ..self
        }
    }

    /// A waveform of positions, read evenly at most so often in its whole length.
    pub(crate) fn positions_along(
        name: &str,
        mut waveform: Waveform,
        points: Vec<i16>,
        most: u32,
        tick_hz: u32,
    ) -> Self {
        waveform.quantity = Quantity::Position;
        let ticks = ticks(&waveform, tick_hz);
        let period = ticks.div_ceil(most.into()).clamp(1, u16::MAX.into());
        let stream = Stream {
            period_ticks: period as u16,
            count: (ticks / period) as u32 + 1,
            mean_ticks: 1,
            slowing: 0,
        };
        let run = Run {
            rest_s: 0.0,
            waveform,
            points,
            stream,
        };
        Self::of(name, Reading::EndOfDwell, vec![run])
    }

    fn of(name: &str, reading: Reading, runs: Vec<Run>) -> Self {
        Self {
            name: name.to_owned(),
            rest_s: 0.0,
            prehold: None,
            drive: None,
            reading,
            runs,
        }
    }

    /// The same after so long a rest.
    pub(crate) fn after(self, rest_s: f64) -> Self {
        Self { rest_s, ..self }
    }

    /// The same under another name.
    pub(crate) fn named(self, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..self
        }
    }

    /// How long it takes (s).
    pub(crate) fn duration_s(&self, tick_hz: u32) -> f64 {
        let run =
            |run: &Run| run.rest_s + ticks(&run.waveform, tick_hz) as f64 / f64::from(tick_hz);
        let runs: f64 = self.runs.iter().map(run).sum();
        self.rest_s + self.prehold.map_or(0.0, |(_, held_s)| held_s) + runs
    }

    /// What its waveforms ask for, tick by tick.
    pub(crate) fn asked(&self, tick_hz: u32) -> Vec<f64> {
        let mut asked = Vec::new();
        for run in &self.runs {
            let Ok(mut player) = Player::new(run.waveform, tick_hz) else {
                continue;
            };
            while !player.is_over() {
                asked.push(decimal(player.next(|index| run.points[index])));
            }
        }
        asked
    }

    /// Samples that it brings.
    pub(crate) fn samples(&self) -> u64 {
        self.runs
            .iter()
            .map(|run| u64::from(run.stream.count))
            .sum()
    }
}

/// The session that a fit and a diagnosis want, up to `max`: sweep, step, four sines, each actuator
/// alone, and the sweep again, coarser.
pub(crate) fn session(max: Voltage, tick_hz: u32) -> Result<Vec<Experiment>, ToolError> {
    let mut experiments = in_common(max, tick_hz)?;
    let single = Experiment::single(max, 7, Span { s: 1.0 }, tick_hz)?.after(5.0);
    let repeat = Experiment::sweep(max, 7, Span { s: 1.0 }, 1, tick_hz)?;
    experiments.extend([single, repeat.named("repeat").after(7.0)]);
    Ok(experiments)
}

/// The part of it in which all actuators move alike, which is what a piston calibration inverts.
pub(crate) fn in_common(max: Voltage, tick_hz: u32) -> Result<Vec<Experiment>, ToolError> {
    let second = Span { s: 1.0 };
    let volts = |share: f64| Voltage { v: max.v * share };
    let sine = |hz: f64| {
        let (mean, amplitude) = (volts(1.0 / 3.5), volts(0.5 / 3.5));
        Experiment::sine(mean, amplitude, Frequency { hz }, 3, tick_hz)
    };
    let rate = Frequency { hz: 5e3 };
    Ok(vec![
        Experiment::sweep(max, 35, second, 1, tick_hz)?,
        Experiment::step(volts(2.0 / 3.5), Span { s: 30.0 }, rate, tick_hz)?.after(20.0),
        sine(0.1)?.after(20.0),
        sine(1.0)?.after(5.0),
        sine(20.0)?.after(5.0),
        sine(100.0)?.after(5.0),
    ])
}
