//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::quantity::{Frequency, Hold, Length, MINUS, Resistance, Span, Voltage};

/// A negative quantity with a minus sign instead of the hyphen that would make it an option, so that
/// `-0.1V` is told to be out of range rather than unknown.
pub fn negative_as_value(word: OsString) -> OsString {
    match word.to_str().and_then(|text| text.strip_prefix('-')) {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') => {
            format!("{MINUS}{rest}").into()
        }
        _ => word,
    }
}

/// Bench tool for electrothermal MEMS mirrors on the driver board.
#[derive(Debug, Parser)]
#[command(name = "host-tool", version)]
pub struct Arguments {
    /// The board: its serial number, an emulated board's name, or a socket's path. Without it, the
    /// only one there is.
    #[arg(long, global = true, env = "MIRROR_BOARD", value_name = "NAME")]
    pub board: Option<String>,

    /// Print JSON instead of text.
    #[arg(long, global = true)]
    pub json: bool,

    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the tool can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// List the boards that are there.
    List,
    /// Find out why a board is not found, and what to do.
    Doctor,
    /// Write new firmware to a board on USB, or to one in its bootloader.
    Update {
        /// The firmware, as `cargo xtask build stm32g474` makes it.
        #[arg(value_name = "FILE")]
        firmware: PathBuf,
    },
    /// Show who the board is and what it is doing.
    Status,
    /// Move the mirror to a position and print what it took.
    SetZ {
        /// Where to, from rest and towards the substrate: 120um, 0.12mm.
        z: Length,
        /// How long to let the mirror settle before reading it.
        #[arg(long, default_value = "1s")]
        settle: Span,
        /// How long the board holds it after that without being told again: 2s, 1h, forever. Then it
        /// ramps to zero.
        #[arg(long, default_value = "10min")]
        hold: Hold,
    },
    /// Drive the actuators with these voltages.
    SetDrive {
        /// One voltage for all actuators, or one for each: 1.9V, or 1.9V 1.9V 1.8V 1.9V.
        #[arg(required = true)]
        drives: Vec<Voltage>,
        /// How long to let the mirror settle before reading it.
        #[arg(long, default_value = "1s")]
        settle: Span,
        /// How long the board holds them after that without being told again: 2s, 1h, forever. Then
        /// it ramps to zero.
        #[arg(long, default_value = "10min")]
        hold: Hold,
    },
    /// Turn all channels off.
    Off,
    /// Forget the faults that have turned the board off, so that it can be driven again.
    Clear,
    /// Record what the board measures, without changing what it drives.
    Record {
        /// The measurement file to write.
        #[arg(short, long)]
        output: PathBuf,
        /// How long, in the board's time.
        #[arg(long, default_value = "1s")]
        duration: Span,
        /// From one sample to the next.
        #[arg(long, default_value = "1ms")]
        period: Span,
        /// Replace the file if it exists.
        #[arg(long)]
        force: bool,
    },
    /// Measure the mirror with one of the paper's experiments; the channels are off afterwards.
    #[command(subcommand)]
    Measure(Measure),
    /// Move the mirror along a sine, a triangle or a waveform of your own; the channels are off
    /// afterwards.
    #[command(subcommand)]
    Scan(Scan),
    /// Teach the board its mirror: measure, identify, build the tables, upload, and try them at other
    /// positions; before and after.
    Calibrate(Calibrate),
    /// Calibrate the board's current sense: its zero, with the mirror in place, and with a known resistor in the place of
    /// each actuator its gain; the channels are off afterwards.
    CalibrateSense {
        /// The resistor that is connected to each channel in place of the mirror: 499ohm. 300 to 1000 ohm.
        #[arg(long, value_name = "RESISTANCE")]
        resistor: Option<Resistance>,
    },
    /// Explain a fault or a limit: what it is, its cause, and its remedy.
    Explain {
        /// Its name, as `status` shows it; without it, all names.
        name: Option<String>,
    },
    /// Fit a model's parameters to measurements.
    Fit {
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
    /// Identify the mirror for a calibration: as many thermal poles, and as much memory and resonance, as
    /// the measurements support.
    Identify {
        /// Model to start from, and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
    /// Show where a model fails: by experiment, by stage, and in sentences.
    Compare {
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// Draw measured and modelled curves and what is left between them, as SVG.
        #[arg(long, value_name = "FILE")]
        picture: Option<PathBuf>,
    },
    /// Say which physical effect a model lacks, or that these data cannot tell and what would.
    Diagnose {
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// Also try this effect of your own, a TOML file as `effect new` writes it.
        #[arg(long, value_name = "FILE")]
        effect: Vec<PathBuf>,
    },
    /// The physical effects that a model can have.
    #[command(subcommand)]
    Effect(EffectCommand),
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// The waveforms of positions.
#[derive(Debug, Subcommand)]
pub enum Scan {
    /// A sine from its middle upwards.
    Sine {
        /// Its numbers.
        #[command(flatten)]
        curve: Curve,
        /// Where the samples go.
        #[command(flatten)]
        to: Samples,
    },
    /// Straight lines from the middle up, down and back.
    Triangle {
        /// Its numbers.
        #[command(flatten)]
        curve: Curve,
        /// Where the samples go.
        #[command(flatten)]
        to: Samples,
    },
    /// Straight lines from point to point.
    Csv {
        /// Lines of seconds and micrometres.
        file: PathBuf,
        /// How often it is gone through.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
        cycles: u32,
        /// Where the samples go.
        #[command(flatten)]
        to: Samples,
    },
}

/// A waveform that repeats.
#[derive(Debug, Args)]
pub struct Curve {
    /// Its middle.
    #[arg(long, default_value = "80um")]
    pub offset: Length,
    /// From its middle to its top.
    #[arg(long, default_value = "20um")]
    pub amplitude: Length,
    /// Cycles a second.
    #[arg(long, default_value = "1Hz")]
    pub frequency: Frequency,
    /// How many.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub cycles: u32,
}

/// The measurement file of a scan.
#[derive(Debug, Args)]
pub struct Samples {
    /// Keep the samples in this measurement file.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(long)]
    pub force: bool,
}

impl Samples {
    /// The file, if there is to be one, and whether it may be replaced.
    pub fn file(self) -> Option<(PathBuf, bool)> {
        self.output.map(|path| (path, self.force))
    }
}

/// What a calibration takes, and leaves.
#[derive(Debug, Args)]
pub struct Calibrate {
    /// The model to start from: a file, or a preset (paper, paper-refit, reconciled).
    #[arg(default_value = "reconciled")]
    pub model: String,
    /// Identify from the measurements in this folder, instead of measuring anew.
    #[arg(long, value_name = "FOLDER")]
    pub from: Option<PathBuf>,
    /// Keep the measurement files in this folder.
    #[arg(long, value_name = "FOLDER", conflicts_with = "from")]
    pub keep: Option<PathBuf>,
    /// Also write the calibration to this file.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Also write the identified model to this file.
    #[arg(long, value_name = "FILE")]
    pub model_output: Option<PathBuf>,
    /// Draw error, step and loop before and after, as SVG.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// What to call the mirror; without it, as the board is called.
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Where displacements come from: `board`, or a serial sensor such as /dev/ttyACM0.
    #[arg(long, default_value = "board", value_name = "SENSOR")]
    pub sensor: String,
    /// Replace files that exist.
    #[arg(long)]
    pub force: bool,
}

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum Measure {
    /// With a board.
    #[command(flatten)]
    Experiment(Experiment),
    /// The tilt of the plate from a scan of points over it: the plane by principal components, and its two
    /// angles. Hold a drive (`set-drive --hold`), move your sensor's spot, and write down what it reads.
    Plane {
        /// Lines of x, y and z in micrometres.
        scan: PathBuf,
    },
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
    /// /dev/ttyACM0, or a file with lines of seconds and micrometres that is complete by the end.
    #[arg(long, default_value = "board", value_name = "SENSOR")]
    pub sensor: String,
    /// Temperature of the room or oven in degrees Celsius, for the files.
    #[arg(long = "ambient", value_name = "CELSIUS")]
    pub ambient_c: Option<f64>,
    /// Replace files that exist.
    #[arg(long)]
    pub force: bool,
}

/// A model and what was measured.
#[derive(Debug, Args)]
pub struct LabInput {
    /// A model file, or a preset: paper, paper-refit, reconciled.
    pub model: String,
    /// Measurement files, or folders of them; together they are one session.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
}

/// Where a model is written.
#[derive(Debug, Args)]
pub struct ModelOutput {
    /// The model file to write.
    #[arg(short, long, value_name = "MODEL")]
    pub output: PathBuf,
    /// Replace the file if it exists.
    #[arg(long)]
    pub force: bool,
}

/// What can be done with effects.
#[derive(Debug, Subcommand)]
pub enum EffectCommand {
    /// List them, in the order of the stages.
    List,
    /// Tell what one is, its equation, how it shows, and what separates it from others.
    Show {
        /// Its id.
        id: String,
    },
    /// Write a file to describe an effect of your own in.
    New {
        /// The file to write.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Add one to a model, refit, and print the error before and after.
    Add {
        /// Its id, or the file of an effect of your own.
        effect: String,
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
    /// Take one out of a model, refit, and print the error before and after.
    Remove {
        /// Its id.
        effect: String,
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
}
