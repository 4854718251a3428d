//! Measurements as a person asks for them.

use serde::Serialize;

use crate::experiment::Experiment;
use crate::session::{COLD_SWEEP, HEIGHTS_UM, session};

/// What the bench can be asked to measure, with its numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measurement {
    /// All actuators up in equal steps and down again.
    Sweep {
        /// Highest drive (V).
        max_v: f64,
        /// Steps up, and as many down.
        steps: u32,
        /// How long each is held (s).
        dwell_s: f64,
        /// How often up and down.
        cycles: u32,
    },
    /// All actuators up at once and down again.
    Step {
        /// The drive that is stepped to (V).
        to_v: f64,
        /// How long it is held, and 0 V after it (s).
        hold_s: f64,
        /// Readings a second just after an edge (Hz).
        rate_hz: f64,
    },
    /// A sine on all actuators.
    Sine {
        /// Its middle (V).
        mean_v: f64,
        /// From its middle to its top (V).
        amplitude_v: f64,
        /// Cycles a second (Hz).
        frequency_hz: f64,
        /// How many.
        cycles: u32,
    },
    /// Each actuator alone, the others at a sense bias.
    Single {
        /// Highest drive (V).
        max_v: f64,
        /// Steps up.
        steps: u32,
        /// How long each is held (s).
        dwell_s: f64,
    },
    /// These voltages on all actuators, one after the other.
    Held {
        /// The voltages (V).
        volts: Vec<f64>,
        /// How long each is held (s).
        dwell_s: f64,
    },
    /// The standard session.
    Session {
        /// Highest drive (V).
        max_v: f64,
    },
    /// A stage moves the resting mirror under the sensor.
    Reference {
        /// To these heights (um), one after the other.
        heights_um: Vec<f64>,
        /// How long stage and sensor settle at each (s).
        dwell_s: f64,
    },
}

impl Measurement {
    /// A sweep up to `max_v` with the session's steps.
    pub const fn sweep(max_v: f64) -> Self {
        Self::Sweep {
            max_v,
            steps: 35,
            dwell_s: 1.0,
            cycles: 1,
        }
    }

    /// A sweep too small to heat much.
    pub const COLD_SWEEP: Self = Self::Sweep {
        max_v: COLD_SWEEP.0,
        steps: COLD_SWEEP.1,
        dwell_s: 1.0,
        cycles: 1,
    };

    /// A stage goes up and down a ladder of heights.
    pub fn reference() -> Self {
        Self::Reference {
            heights_um: HEIGHTS_UM.to_vec(),
            dwell_s: 1.0,
        }
    }

    /// What is played for it.
    pub fn experiments(&self) -> Vec<Experiment> {
        let experiment = match *self {
            Self::Session { max_v } => return session(max_v),
            Self::Sweep {
                max_v,
                steps,
                dwell_s,
                cycles,
            } => Experiment::sweep(max_v, steps, dwell_s, cycles),
            Self::Step {
                to_v,
                hold_s,
                rate_hz,
            } => Experiment::step(to_v, hold_s, rate_hz),
            Self::Sine {
                mean_v,
                amplitude_v,
                frequency_hz,
                cycles,
            } => Experiment::sine(mean_v, amplitude_v, frequency_hz, cycles),
            Self::Single {
                max_v,
                steps,
                dwell_s,
            } => Experiment::single(max_v, steps, dwell_s),
            Self::Held { ref volts, dwell_s } => Experiment::held(volts, dwell_s),
            Self::Reference {
                ref heights_um,
                dwell_s,
            } => Experiment::reference(heights_um, dwell_s),
        };
        vec![experiment]
    }
}
