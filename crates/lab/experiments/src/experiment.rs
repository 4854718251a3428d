//! One experiment: what moves, and how.

use std::f64::consts::TAU;

use crate::instruments::SENSE_BIAS_V;
use crate::reading::Reading;
use crate::tilt::{Beginnings, Tilt, between, span};

/// How many actuators a mirror has.
pub const ACTUATORS: usize = 4;

/// Readings in a cycle of a sine of drives: enough for the tenth harmonic.
const READINGS_PER_CYCLE: u32 = 100;
/// The mean of a sine is held so long before it (s), so that the mirror is warm: 10 of its slowest time constants.
const PREHOLD_S: f64 = 5.0;
/// Between two actuators that are heated alone the mirror cools so long (s): four of them.
const BETWEEN_ACTUATORS_S: f64 = 2.0;

/// One experiment: one measurement file.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// `sweep`, `step`, `sine_20`, `single`, ...
    pub name: String,
    /// Time at 0 V before it, at least (s).
    pub rest_s: f64,
    /// What is held just before it.
    pub prehold: Option<Prehold>,
    /// How much warmer the surroundings are than at the session's start (K), from the rest before it on.
    pub ambient_rise_k: f64,
    /// When it is read.
    pub reading: Reading,
    /// What moves, one after the other.
    pub runs: Vec<Run>,
}

/// A drive that is held on all actuators before an experiment's clock starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prehold {
    /// The drive (V).
    pub volts: f64,
    /// How long, at least (s).
    pub seconds: f64,
}

/// A signal of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Time at 0 V before it, which the experiment's own clock leaves out (s).
    pub rest_s: f64,
    /// What moves.
    pub quantity: Quantity,
    /// How it moves.
    pub signal: Signal,
    /// How often, at least once.
    pub cycles: u32,
    /// How the plate tilts about x and y while a position moves; where it says nothing, it is level.
    pub tilts: Option<[Tilt; 2]>,
    /// What begins in each cycle.
    pub begins: Beginnings,
}

/// What a signal moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// The voltage of some actuators (V).
    Voltage {
        /// Which.
        active: [bool; ACTUATORS],
        /// Voltage of the others (V).
        others_v: f64,
    },
    /// The position that the board is asked for (um).
    Position,
    /// How far a stage has moved the resting mirror under the sensor, towards the substrate (um). No board does it.
    StageHeight,
}

/// How a quantity moves, in its own unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// Each value is held for the dwell.
    Steps {
        /// The values.
        values: Vec<f64>,
        /// How long each is held (s).
        dwell_s: f64,
    },
    /// In a straight line from value to value.
    Lines {
        /// The values.
        values: Vec<f64>,
        /// How long each line takes (s).
        dwell_s: f64,
    },
    /// A sine from its mean upwards.
    Sine(Wave),
    /// Straight lines from the mean up, down, and back.
    Triangle(Wave),
}

/// The numbers of a periodic signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Its middle.
    pub mean: f64,
    /// From its middle to its top.
    pub amplitude: f64,
    /// Cycles a second (Hz).
    pub frequency_hz: f64,
}

impl Quantity {
    /// The voltage of all actuators alike.
    pub const TOGETHER: Self = Self::Voltage {
        active: [true; ACTUATORS],
        others_v: 0.0,
    };

    /// The voltage of one actuator, the others sensed.
    pub fn alone(actuator: usize) -> Self {
        let mut active = [false; ACTUATORS];
        active[actuator] = true;
        Self::Voltage {
            active,
            others_v: SENSE_BIAS_V,
        }
    }
}

impl Signal {
    /// How long one cycle takes (s).
    pub fn period_s(&self) -> f64 {
        match self {
            Self::Steps { values, dwell_s } => values.len() as f64 * dwell_s,
            Self::Lines { values, dwell_s } => values.len().saturating_sub(1) as f64 * dwell_s,
            Self::Sine(wave) | Self::Triangle(wave) => 1.0 / wave.frequency_hz,
        }
    }

    /// Its value so long after its start (s); it goes through its cycles without end.
    pub fn at(&self, t_s: f64) -> f64 {
        let cycles = t_s / self.period_s();
        match self {
            Self::Sine(wave) => wave.sine(cycles),
            Self::Triangle(wave) => wave.triangle(cycles),
            Self::Steps { values, .. } => {
                let place = cycles.rem_euclid(1.0) * values.len() as f64;
                values.get(place as usize).copied().unwrap_or(f64::NAN)
            }
            Self::Lines { values, .. } => between(values, cycles),
        }
    }

    /// The lowest and the highest value.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Steps { values, .. } | Self::Lines { values, .. } => span(values),
            Self::Sine(wave) | Self::Triangle(wave) => {
                let reach = wave.amplitude.abs();
                (wave.mean - reach, wave.mean + reach)
            }
        }
    }
}

impl Wave {
    /// The sine at so many cycles since its start.
    pub fn sine(&self, cycles: f64) -> f64 {
        self.mean + self.amplitude * (TAU * cycles).sin()
    }

    /// The triangle at so many cycles since its start.
    fn triangle(&self, cycles: f64) -> f64 {
        // In quarters of a cycle since the lowest point.
        let quarters = 4.0 * (cycles + 0.25).fract();
        self.mean + self.amplitude * (1.0 - (quarters - 2.0).abs())
    }
}

impl Run {
    /// Without a rest, once.
    pub fn new(quantity: Quantity, signal: Signal) -> Self {
        Self {
            rest_s: 0.0,
            quantity,
            signal,
            cycles: 1,
            tilts: None,
            begins: Beginnings::default(),
        }
    }

    /// Positions along a signal (um).
    pub fn along(signal: Signal, cycles: u32) -> Self {
        Self {
            cycles,
            ..Self::new(Quantity::Position, signal)
        }
    }

    /// Tilts about x and y so long after its start (rad).
    pub fn tilts_at(&self, t_s: f64) -> [f64; 2] {
        let cycles = t_s / self.signal.period_s();
        let at = |tilts: &[Tilt; 2]| tilts.each_ref().map(|tilt| tilt.at(cycles));
        self.tilts.as_ref().map_or([0.0; 2], at)
    }

    /// How long it takes, without the rest before it (s).
    pub fn duration_s(&self) -> f64 {
        f64::from(self.cycles) * self.signal.period_s()
    }
}

impl Experiment {
    /// All actuators up to `max_v` in `steps` equal steps and down again, so often, read at the end of each step.
    pub fn sweep(max_v: f64, steps: u32, dwell_s: f64, cycles: u32) -> Self {
        let ladder = (0..=steps).chain((0..steps).rev());
        let values = ladder.map(|step| share_of(max_v, step, steps)).collect();
        let signal = Signal::Steps { values, dwell_s };
        let run = Run {
            cycles,
            ..Run::new(Quantity::TOGETHER, signal)
        };
        Self::new("sweep", Reading::EndOfDwell, vec![run])
    }

    /// These voltages on all actuators, one after the other, read at the end of each.
    pub fn held(volts: &[f64], dwell_s: f64) -> Self {
        let values = volts.to_vec();
        let run = Run::new(Quantity::TOGETHER, Signal::Steps { values, dwell_s });
        Self::new("held", Reading::EndOfDwell, vec![run])
    }

    /// All actuators from 0 to `to_v` and back to 0 after `hold_s`, read at `rate_hz` just after each edge and then ever
    /// more slowly.
    pub fn step(to_v: f64, hold_s: f64, rate_hz: f64) -> Self {
        let signal = Signal::Steps {
            values: vec![to_v, 0.0],
            dwell_s: hold_s,
        };
        let run = Run::new(Quantity::TOGETHER, signal);
        Self::new("step", Reading::AfterSteps { rate_hz }, vec![run])
    }

    /// A sine on all actuators, which are warm before it begins.
    pub fn sine(mean_v: f64, amplitude_v: f64, frequency_hz: f64, cycles: u32) -> Self {
        let wave = Wave {
            mean: mean_v,
            amplitude: amplitude_v,
            frequency_hz,
        };
        let run = Run {
            cycles,
            ..Run::new(Quantity::TOGETHER, Signal::Sine(wave))
        };
        let name = format!("sine_{frequency_hz}").replace('.', "p");
        let readings = READINGS_PER_CYCLE.saturating_mul(cycles);
        Self {
            prehold: Some(Prehold {
                volts: mean_v,
                seconds: PREHOLD_S,
            }),
            ..Self::new(&name, Reading::Evenly { readings }, vec![run])
        }
    }

    /// Each actuator alone up to `max_v` in `steps` equal steps, the others at a sense bias, at rest in between.
    pub fn single(max_v: f64, steps: u32, dwell_s: f64) -> Self {
        let values: Vec<f64> = (0..=steps)
            .map(|step| share_of(max_v, step, steps))
            .collect();
        let alone = |actuator: usize| Run {
            rest_s: if actuator == 0 {
                0.0
            } else {
                BETWEEN_ACTUATORS_S
            },
            ..Run::new(
                Quantity::alone(actuator),
                Signal::Steps {
                    values: values.clone(),
                    dwell_s,
                },
            )
        };
        let runs = (0..ACTUATORS).map(alone).collect();
        Self::new("single", Reading::EndOfDwell, runs)
    }

    /// A stage moves the resting mirror under the sensor to each of these heights (um), `dwell_s` each.
    pub fn reference(heights_um: &[f64], dwell_s: f64) -> Self {
        let signal = Signal::Steps {
            values: heights_um.to_vec(),
            dwell_s,
        };
        let run = Run::new(Quantity::StageHeight, signal);
        Self::new("reference", Reading::EndOfDwell, vec![run])
    }

    /// Positions one after the other (um), read at the end of each dwell.
    pub fn positions(name: &str, z_um: &[f64], dwell_s: f64) -> Self {
        let values = z_um.to_vec();
        let run = Run::new(Quantity::Position, Signal::Steps { values, dwell_s });
        Self::new(name, Reading::EndOfDwell, vec![run])
    }

    /// Positions one after the other (um), read as fast as the board can after each jump and then ever more slowly.
    pub fn jumps(name: &str, z_um: &[f64], hold_s: f64) -> Self {
        Self {
            reading: Reading::AfterSteps {
                rate_hz: f64::INFINITY,
            },
            ..Self::positions(name, z_um, hold_s)
        }
    }

    /// Positions along a signal (um), read evenly at most so often in its whole length.
    pub fn along(name: &str, signal: Signal, cycles: u32, readings: u32) -> Self {
        Self::scan(name, Run::along(signal, cycles), readings)
    }

    /// A run, read evenly at most so often in its whole length.
    pub fn scan(name: &str, run: Run, readings: u32) -> Self {
        Self::new(name, Reading::Evenly { readings }, vec![run])
    }

    pub(crate) fn new(name: &str, reading: Reading, runs: Vec<Run>) -> Self {
        Self {
            name: name.to_owned(),
            rest_s: 0.0,
            prehold: None,
            ambient_rise_k: 0.0,
            reading,
            runs,
        }
    }

    /// The same after so long a rest (s).
    #[must_use]
    pub fn after(self, rest_s: f64) -> Self {
        Self { rest_s, ..self }
    }

    /// The same under another name.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..self
        }
    }

    /// The same in surroundings that are so much warmer than at the session's start (K).
    #[must_use]
    pub fn with_ambient_rise(self, ambient_rise_k: f64) -> Self {
        Self {
            ambient_rise_k,
            ..self
        }
    }

    /// How long it takes, with rests and prehold (s).
    pub fn duration_s(&self) -> f64 {
        let runs: f64 = self
            .runs
            .iter()
            .map(|run| run.rest_s + run.duration_s())
            .sum();
        self.rest_s + self.prehold.map_or(0.0, |prehold| prehold.seconds) + runs
    }

    /// How the drive moves between readings, as measurement files say it: the formula of a sine, `position` where the board
    /// makes the drive on the way, nothing where it is held.
    pub fn drive_key(&self) -> Option<String> {
        let [run] = self.runs.as_slice() else {
            return None;
        };
        match (run.quantity, &run.signal, self.reading) {
            (Quantity::Position, _, Reading::Evenly { .. } | Reading::AfterSteps { .. }) => {
                Some("position".into())
            }
            (Quantity::Voltage { .. }, Signal::Sine(wave), _) => Some(format!(
                "{:?}+{:?}*sin(2*pi*f*t)",
                wave.mean, wave.amplitude
            )),
            _ => None,
        }
    }
}

/// So many of `steps` equal steps up to `top`.
fn share_of(top: f64, step: u32, steps: u32) -> f64 {
    top * f64::from(step) / f64::from(steps)
}

#[cfg(test)]
mod tests;
