//! The command line.

mod lab;
mod measure;
mod moving;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Parser, Subcommand};

pub use self::lab::{EffectCommand, LabInput, ModelOutput};
pub use self::measure::{Experiment, Instruments, Measure, OneFile, Plane, Reference};
pub use self::moving::{Calibrate, Curve, Samples, Scan};
use crate::quantity::{Hold, Length, MINUS, Resistance, Span, Voltage};

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
