//! `measure`: what can be measured, and with what.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use quantities::{Frequency, Length, QuantityError, Span, Temperature, Voltage, in_unit};

use experiments::Measurement;

use super::defaults::{
    AMPLITUDE, CYCLES, DWELL, FREQUENCY, HOLD, MAX, MEAN, RATE, REFERENCE_FILE, SINGLE_STEPS,
    STEP_TO, SWEEP_STEPS,
};
use super::heading::{BOARD, INPUT, OUTPUT, SIGNAL};
use super::some::some;
use super::whole::whole;

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum Measure {
    /// With a board.
    #[command(flatten)]
    Experiment(DriveExperiment),
    /// The tilt of the plate: at each voltage a scan of points over it with your sensor's spot, the plane through them by
    /// principal components, and its two angles.
    #[command(after_long_help = "Example:\n  host-tool measure plane 0V 1V 2V --points grid.csv")]
    Plane(Plane),
    /// What your sensor reads of the resting mirror where a stage has moved it by known heights: shows the sensor's own
    /// errors, which no drive does.
    #[command(after_long_help = "Example:\n  host-tool measure reference 0um 50um 100um 50um 0um")]
    Reference(Reference),
}

/// A reference for the sensor.
#[derive(Debug, Args)]
pub struct Reference {
    /// How far the stage has moved the whole mirror towards the substrate's side, one height after the other: 0um 50um 100um.
    /// The tool asks for each.
    #[arg(required = true, num_args = 2..)]
    pub heights: Vec<Length>,
    /// How long to let stage and sensor settle at each height.
    #[arg(help_heading = SIGNAL, long, default_value = DWELL)]
    pub settle: Span,
    /// The measurement file to write.
    #[arg(help_heading = OUTPUT, short, long, default_value = REFERENCE_FILE, value_name = "FILE")]
    pub output: PathBuf,
    /// What measures.
    #[command(flatten)]
    pub instruments: Instruments,
}

/// A scan of the plate.
#[derive(Debug, Args)]
pub struct Plane {
    /// Voltages on all actuators, one after the other; the plate is scanned at each.
    #[arg(required_unless_present = "from")]
    pub volts: Vec<Voltage>,
    /// The plane through a scan that exists: lines of x, y and z in micrometres.
    #[arg(help_heading = INPUT, long, value_name = "SCAN", conflicts_with_all = ["volts", "points"])]
    pub from: Option<PathBuf>,
    /// Where on the plate: lines of x and y in micrometres from its centre. The tool asks for the spot to be moved to each.
    /// Without it, it asks where the spot is.
    #[arg(help_heading = SIGNAL, long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// How long to let the mirror settle at each voltage.
    #[arg(help_heading = SIGNAL, long, default_value = "2s")]
    pub settle: Span,
    /// The measurement file to write; the scans lie beside it.
    #[arg(help_heading = OUTPUT, short, long, default_value = "plane.csv", value_name = "FILE")]
    pub output: PathBuf,
    /// What measures.
    #[command(flatten)]
    pub instruments: Instruments,
}

/// What drives can be measured.
#[derive(Debug, Subcommand)]
pub enum DriveExperiment {
    /// All actuators up in equal steps and down again, read at the end of each.
    #[command(
        after_long_help = "Example:\n  host-tool measure sweep --max 3V --steps 30 -o sweep.csv"
    )]
    Sweep {
        /// Highest drive.
        #[arg(help_heading = SIGNAL, long, default_value = MAX, value_parser = some(|max: &Voltage| max.v))]
        max: Voltage,
        /// Steps up, and as many down.
        #[arg(help_heading = SIGNAL, long, default_value_t = SWEEP_STEPS, value_parser = whole(1..=255_u32))]
        steps: u32,
        /// How long each step is held.
        #[arg(help_heading = SIGNAL, long, default_value = DWELL)]
        dwell: Span,
        /// How often up and down.
        #[arg(help_heading = SIGNAL, long, default_value_t = 1, value_parser = whole(1..=1000_u32))]
        repeat: u32,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// All actuators up at once and down again, read ever more slowly after each edge.
    #[command(after_long_help = "Example:\n  host-tool measure step --to 2V --hold 60s")]
    Step {
        /// The drive that is stepped to.
        #[arg(help_heading = SIGNAL, long = "to", default_value = STEP_TO)]
        volts: Voltage,
        /// How long it is held, and how long 0 V after it.
        #[arg(help_heading = SIGNAL, long, default_value = HOLD)]
        hold: Span,
        /// Readings a second just after an edge.
        #[arg(help_heading = SIGNAL, long, default_value = RATE)]
        rate: Frequency,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// A sine on all actuators, 100 readings a cycle.
    #[command(
        after_long_help = "Example:\n  host-tool measure sine --mean 1V --amplitude 0.5V --frequency 20Hz"
    )]
    Sine {
        /// Its middle, held for 5 s before.
        #[arg(help_heading = SIGNAL, long, default_value = MEAN)]
        mean: Voltage,
        /// From its middle to its top.
        #[arg(help_heading = SIGNAL, long, default_value = AMPLITUDE)]
        amplitude: Voltage,
        /// Cycles a second.
        #[arg(help_heading = SIGNAL, long, default_value = FREQUENCY)]
        frequency: Frequency,
        /// How many.
        #[arg(help_heading = SIGNAL, long, default_value_t = CYCLES, value_parser = whole(1..=1_000_000_u32))]
        cycles: u32,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// Each actuator alone, the others idle at a small sense voltage.
    #[command(after_long_help = "Example:\n  host-tool measure single --max 2V")]
    Single {
        /// Highest drive.
        #[arg(help_heading = SIGNAL, long, default_value = MAX, value_parser = some(|max: &Voltage| max.v))]
        max: Voltage,
        /// Steps up.
        #[arg(help_heading = SIGNAL, long, default_value_t = SINGLE_STEPS, value_parser = whole(1..=255_u32))]
        steps: u32,
        /// How long each step is held.
        #[arg(help_heading = SIGNAL, long, default_value = DWELL)]
        dwell: Span,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// These voltages on all actuators, one after the other, read at the end of each.
    #[command(after_long_help = "Example:\n  host-tool measure held 0V 1V 2V 1V 0V --dwell 2s")]
    Held {
        /// The voltages, two at least: a file of one row is no measurement.
        #[arg(required = true, num_args = 2..)]
        volts: Vec<Voltage>,
        /// How long each is held.
        #[arg(help_heading = SIGNAL, long, default_value = DWELL)]
        dwell: Span,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// Everything that a fit and a diagnosis want, in about six minutes: a minute of rest, sweep, step, four sines, each
    /// actuator alone, and the sweep again.
    #[command(after_long_help = "Example:\n  host-tool measure session --ambient 22 -o session")]
    Session {
        /// The folder for the files.
        #[arg(help_heading = OUTPUT, short, long, value_name = "FOLDER")]
        output: PathBuf,
        /// Highest drive.
        #[arg(help_heading = SIGNAL, long, default_value = MAX, value_parser = some(|max: &Voltage| max.v))]
        max: Voltage,
        /// What measures.
        #[command(flatten)]
        instruments: Instruments,
    },
}

/// One experiment's file.
#[derive(Debug, Args)]
pub struct OneFile {
    /// The measurement file to write; without it, the experiment's name with `.csv`.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Time at 0 V before the experiment.
    #[arg(help_heading = SIGNAL, long, default_value = "5s")]
    pub rest: Span,
    /// What measures.
    #[command(flatten)]
    pub instruments: Instruments,
}

/// Surroundings of a mirror (degC): from liquid nitrogen to the films' deposition, beyond any oven that a bench has.
const SURROUNDINGS_C: RangeInclusive<f64> = -196.0..=300.0;

/// So many degrees, with or without their unit.
fn celsius(text: &str) -> Result<f64, String> {
    let celsius = in_unit(text, "degC").map(|Temperature { celsius }| celsius);
    let celsius = celsius.ok().filter(|c| SURROUNDINGS_C.contains(c));
    celsius.ok_or_else(|| {
        let (low, high) = SURROUNDINGS_C.into_inner();
        format!("write degrees from {low} to {high}: 22.5")
    })
}

/// No sensor of a mirror tells later (s): a choice.
const LATEST_S: f64 = 10.0;

/// How late a sensor may be.
pub(super) fn lag(text: &str) -> Result<Span, String> {
    let span: Span = text
        .parse()
        .map_err(|error: QuantityError| error.to_string())?;
    match span.s <= LATEST_S {
        true => Ok(span),
        false => Err(format!("no sensor is later than {LATEST_S} s")),
    }
}

/// What measures besides the board's currents.
#[derive(Debug, Args)]
pub struct Instruments {
    /// Where displacements come from: `board`, a serial sensor that sends lines of micrometres such as
    /// /dev/ttyACM0 (with its speed, where it has one: /dev/ttyUSB0@115200), or a file with lines of seconds and
    /// micrometres that is complete by the end.
    #[arg(help_heading = BOARD, long, default_value = "board", value_name = "SENSOR")]
    pub sensor: String,
    /// How late that sensor tells what it reads; it is taken out of the displacements. The mirror's own lag looks the same,
    /// so name what the sensor's maker states.
    #[arg(help_heading = BOARD, long, default_value = "0ms", value_name = "TIME", value_parser = lag)]
    pub sensor_lag: Span,
    /// Temperature of the room or oven in degrees Celsius, for the files.
    #[arg(help_heading = BOARD, long = "ambient", value_name = "CELSIUS", value_parser = celsius)]
    pub ambient_c: Option<f64>,
    /// Replace files that exist.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

impl DriveExperiment {
    /// What is asked for, as data.
    pub fn measurement(&self) -> Measurement {
        match self {
            Self::Sweep {
                max,
                steps,
                dwell,
                repeat,
                ..
            } => Measurement::Sweep {
                max_v: max.v,
                steps: *steps,
                dwell_s: dwell.s,
                cycles: *repeat,
            },
            Self::Step {
                volts, hold, rate, ..
            } => Measurement::Step {
                to_v: volts.v,
                hold_s: hold.s,
                rate_hz: rate.hz,
            },
            Self::Sine {
                mean,
                amplitude,
                frequency,
                cycles,
                ..
            } => Measurement::Sine {
                mean_v: mean.v,
                amplitude_v: amplitude.v,
                frequency_hz: frequency.hz,
                cycles: *cycles,
            },
            Self::Single {
                max, steps, dwell, ..
            } => Measurement::Single {
                max_v: max.v,
                steps: *steps,
                dwell_s: dwell.s,
            },
            Self::Held { volts, dwell, .. } => Measurement::Held {
                volts: volts.iter().map(|volts| volts.v).collect(),
                dwell_s: dwell.s,
            },
            Self::Session { max, .. } => Measurement::Session { max_v: max.v },
        }
    }

    /// The one file that it goes to; none for a session, which has a folder.
    pub fn file(&self) -> Option<&OneFile> {
        match self {
            Self::Sweep { to, .. }
            | Self::Step { to, .. }
            | Self::Sine { to, .. }
            | Self::Single { to, .. }
            | Self::Held { to, .. } => Some(to),
            Self::Session { .. } => None,
        }
    }

    /// What measures.
    pub fn instruments(&self) -> &Instruments {
        match self {
            Self::Session { instruments, .. } => instruments,
            Self::Sweep { to, .. }
            | Self::Step { to, .. }
            | Self::Sine { to, .. }
            | Self::Single { to, .. }
            | Self::Held { to, .. } => &to.instruments,
        }
    }
}
