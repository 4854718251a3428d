//! `measure`: what can be measured, and with what.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::quantity::{Frequency, Length, Span, Voltage};

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum Measure {
    /// With a board.
    #[command(flatten)]
    Experiment(Experiment),
    /// The tilt of the plate: at each voltage a scan of points over it with your sensor's spot, the plane through them by
    /// principal components, and its two angles.
    Plane(Plane),
    /// What your sensor reads of the resting mirror where a stage has moved it by known heights: shows the sensor's own
    /// errors, which no drive does.
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
    #[arg(long, default_value = "1s")]
    pub settle: Span,
    /// The measurement file to write.
    #[arg(short, long, default_value = "reference.csv", value_name = "FILE")]
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
    #[arg(long, value_name = "SCAN", conflicts_with_all = ["volts", "points"])]
    pub from: Option<PathBuf>,
    /// Where on the plate: lines of x and y in micrometres from its centre. The tool asks for the spot to be moved to each.
    /// Without it, it asks where the spot is.
    #[arg(long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// How long to let the mirror settle at each voltage.
    #[arg(long, default_value = "2s")]
    pub settle: Span,
    /// The measurement file to write; the scans lie beside it.
    #[arg(short, long, default_value = "plane.csv", value_name = "FILE")]
    pub output: PathBuf,
    /// What measures.
    #[command(flatten)]
    pub instruments: Instruments,
}

/// The experiments.
#[derive(Debug, Subcommand)]
pub enum Experiment {
    /// All actuators up in equal steps and down again, read at the end of each.
    Sweep {
        /// Highest drive.
        #[arg(long, default_value = "3.5V")]
        max: Voltage,
        /// Steps up, and as many down.
        #[arg(long, default_value_t = 35, value_parser = clap::value_parser!(u32).range(1..=255))]
        steps: u32,
        /// How long each step is held.
        #[arg(long, default_value = "1s")]
        dwell: Span,
        /// How often up and down.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
        repeat: u32,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// All actuators up at once and down again, read ever more slowly after each edge.
    Step {
        /// The drive that is stepped to.
        #[arg(long = "to", default_value = "2V")]
        volts: Voltage,
        /// How long it is held, and how long 0 V after it.
        #[arg(long, default_value = "30s")]
        hold: Span,
        /// Readings a second just after an edge.
        #[arg(long, default_value = "5kHz")]
        rate: Frequency,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// A sine on all actuators, 100 readings a cycle.
    Sine {
        /// Its middle, held for 5 s before.
        #[arg(long, default_value = "1V")]
        mean: Voltage,
        /// From its middle to its top.
        #[arg(long, default_value = "0.5V")]
        amplitude: Voltage,
        /// Cycles a second.
        #[arg(long, default_value = "1Hz")]
        frequency: Frequency,
        /// How many.
        #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
        cycles: u32,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// Each actuator alone, the others idle at a small sense voltage.
    Single {
        /// Highest drive.
        #[arg(long, default_value = "3.5V")]
        max: Voltage,
        /// Steps up.
        #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=255))]
        steps: u32,
        /// How long each step is held.
        #[arg(long, default_value = "1s")]
        dwell: Span,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// These voltages on all actuators, one after the other, read at the end of each.
    Held {
        /// The voltages.
        #[arg(required = true)]
        volts: Vec<Voltage>,
        /// How long each is held.
        #[arg(long, default_value = "1s")]
        dwell: Span,
        /// Where it goes.
        #[command(flatten)]
        to: OneFile,
    },
    /// Everything that a fit and a diagnosis want, in about five minutes: sweep, step, four sines, each
    /// actuator alone, and the sweep again.
    Session {
        /// The folder for the files.
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
        /// Highest drive.
        #[arg(long, default_value = "3.5V")]
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
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Time at 0 V before the experiment.
    #[arg(long, default_value = "5s")]
    pub rest: Span,
    /// What measures.
    #[command(flatten)]
    pub instruments: Instruments,
}

/// What measures besides the board's currents.
#[derive(Debug, Args)]
pub struct Instruments {
    /// Where displacements come from: `board`, a serial sensor that sends lines of micrometres such as
    /// /dev/ttyACM0 (with its speed, where it has one: /dev/ttyUSB0@115200), or a file with lines of seconds and
    /// micrometres that is complete by the end.
    #[arg(long, default_value = "board", value_name = "SENSOR")]
    pub sensor: String,
    /// Temperature of the room or oven in degrees Celsius, for the files.
    #[arg(long = "ambient", value_name = "CELSIUS")]
    pub ambient_c: Option<f64>,
    /// Replace files that exist.
    #[arg(long)]
    pub force: bool,
}
