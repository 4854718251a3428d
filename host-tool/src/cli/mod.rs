//! The command line.

pub(crate) mod defaults;
pub(crate) mod heading;
mod lab;
mod measure;
mod moving;
mod some;
mod whole;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Parser, Subcommand};
use quantities::{Angle, Hold, Length, MINUS, Resistance, Span, Voltage, is_unit_of};

use self::heading::{BOARD, INPUT, OUTPUT, SIGNAL};
pub use self::lab::{Compare, Diagnose, EffectCommand, Import, LabInput, ModelOutput, Report};
pub use self::measure::{DriveExperiment, Instruments, Measure, OneFile, Plane, Reference};
pub use self::moving::{
    Calibrate, CalibratePose, CalibrateRoom, Curve, DisplacementSensor, Frame, Scan, ScanOutput,
    TiltCurve,
};
use self::some::some;
use crate::completion::candidates;
use crate::verbosity::Verbosity;

/// A negative quantity with a minus sign instead of the hyphen that would make it an option, so that
/// `-0.1V` is told to be out of range rather than unknown.
fn negative_as_value(word: OsString) -> OsString {
    match word.to_str().and_then(|text| text.strip_prefix('-')) {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') => {
            format!("{MINUS}{rest}").into()
        }
        _ => word,
    }
}

/// The words of a command line as they are meant: negative quantities are values, a unit belongs to the number that a person
/// set it apart from, and `help NAME` is `NAME --help`, of which a name that is mistyped is told its neighbour.
pub fn words(typed: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut words: Vec<OsString> = Vec::new();
    for word in typed.map(negative_as_value) {
        let is_unit = |number: &OsString| match (number.to_str(), word.to_str()) {
            (Some(number), Some(word)) => is_unit_of(number, word),
            _ => false,
        };
        match words.last_mut() {
            Some(number) if is_unit(number) => number.push(&word),
            _ => words.push(word),
        }
    }
    if words.len() > 2 && words[1] == "help" {
        words.remove(1);
        words.push("--help".into());
    }
    words
}

/// Bench tool for electrothermal MEMS mirrors on the driver board.
#[derive(Debug, Parser)]
#[command(name = "host-tool", version)]
pub struct Arguments {
    /// The board: its serial number, an emulated board's name, or a socket's path. Without it, the
    /// only one there is.
    #[arg(help_heading = BOARD, long, global = true, env = "MIRROR_BOARD", value_name = "NAME", add = candidates::boards())]
    pub board: Option<String>,

    /// The longest that whoever runs this bench allows a move to be driven, --settle and --hold together, or a scan: 10min. Longer holds
    /// and scans, and `forever`, are refused.
    #[arg(
        help_heading = BOARD,
        long,
        global = true,
        env = "MIRROR_LONGEST_HOLD",
        value_name = "SPAN",
        default_value = "forever"
    )]
    pub longest_hold: Hold,

    /// Print JSON instead of text.
    #[arg(help_heading = OUTPUT, long, global = true)]
    pub json: bool,

    /// Say neither progress nor notes on standard error: failures, warnings and questions only.
    #[arg(help_heading = OUTPUT, short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Say on standard error what the board is asked, and how long each answer took.
    #[arg(help_heading = OUTPUT, short, long, global = true)]
    pub verbose: bool,

    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

impl Arguments {
    /// How much is said beside the report.
    pub(crate) fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, true) => Verbosity::Verbose,
            (false, false) => Verbosity::Usual,
        }
    }
}

/// Whether positions are compensated for the surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Switch {
    /// Compensate positions.
    On,
    /// Leave the mirror to the surroundings.
    Off,
}

/// What the tool can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// List the boards that are there.
    #[command(after_long_help = "Example:\n  host-tool list --json")]
    List,
    /// Find out why a board is not found, and what to do.
    #[command(after_long_help = "Example:\n  host-tool doctor")]
    Doctor,
    /// Write new firmware to a board on USB, or to one in its bootloader.
    #[command(
        after_long_help = "Example:\n  host-tool update target/thumbv7em-none-eabihf/firmware/stm32g474.update"
    )]
    Update {
        /// The firmware, as `cargo xtask build stm32g474` makes it: stm32g474.update.
        #[arg(value_name = "FILE")]
        firmware: PathBuf,
    },
    /// Show who the board is and what it is doing.
    #[command(after_long_help = "Example:\n  host-tool status --history")]
    Status {
        /// Show the fault log too: the board's starts and trips, through resets and power cuts, the newest first.
        #[arg(help_heading = OUTPUT, long)]
        history: bool,
    },
    /// Watch the board and move the mirror by keys, in the terminal.
    #[command(after_long_help = "Example:\n  host-tool monitor --plotjuggler")]
    Monitor {
        /// From one sample to the next, in the board's time: whole ticks of it, of 0.1 ms.
        #[arg(help_heading = SIGNAL, long, default_value = "10ms")]
        period: Span,
        /// The measurement file that `r` records to; where it exists, the next free name with a number.
        #[arg(help_heading = OUTPUT, short, long, default_value = "monitor.csv", value_name = "FILE")]
        output: PathBuf,
        /// Send each sample as JSON in a UDP datagram, as PlotJuggler takes them.
        #[arg(
            help_heading = OUTPUT,
            long,
            value_name = "ADDRESS",
            num_args = 0..=1,
            default_missing_value = "127.0.0.1:9870"
        )]
        plotjuggler: Option<String>,
    },
    /// Move the mirror to a position and print what it took.
    #[command(after_long_help = "Example:\n  host-tool set-z 120um --hold 1h")]
    SetZ {
        /// Where to, from rest and towards the substrate: 120um, 0.12mm.
        z: Length,
        /// How long to let the mirror settle before reading it.
        #[arg(help_heading = SIGNAL, long, default_value = "1s")]
        settle: Span,
        /// How long the board holds it after that without being told again: 2s, 1h, forever. Then it
        /// ramps to zero. Without it 10min, or what the bench allows.
        #[arg(help_heading = SIGNAL, long)]
        hold: Option<Hold>,
    },
    /// Move the mirror to its highest position and back, so that the board knows what it remembers.
    ///
    /// A board that has just started knows nothing of the way that the mirror has come, and friction holds the mirror where that way
    /// has left it. Once it has been over its whole range the board knows.
    #[command(after_long_help = "Example:\n  host-tool condition")]
    Condition,
    /// Move the plate to a pose, piston and tilts, and print what it took.
    #[command(after_long_help = "Example:\n  host-tool set-pose 120um 0.05deg -0.02deg")]
    SetPose {
        /// Piston, from rest and towards the substrate: 120um, 0.12mm.
        z: Length,
        /// Rotation about the x axis, right-handed, by which z rises along y: 0.05deg, 1mrad.
        tilt_x: Angle,
        /// Rotation about the y axis, right-handed, by which z falls along x.
        tilt_y: Angle,
        /// How long to let the mirror settle before reading it.
        #[arg(help_heading = SIGNAL, long, default_value = "1s")]
        settle: Span,
        /// How long the board holds it after that without being told again: 2s, 1h, forever. Then it
        /// ramps to zero. Without it 10min, or what the bench allows.
        #[arg(help_heading = SIGNAL, long)]
        hold: Option<Hold>,
    },
    /// Show which poses the mirror reaches: pistons, and the tilts at each.
    #[command(after_long_help = "Example:\n  host-tool range --picture range.svg")]
    Range {
        /// Draw the poses that can be reached, as SVG.
        #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
        picture: Option<PathBuf>,
        /// Replace the picture if it exists.
        #[arg(help_heading = OUTPUT, long)]
        force: bool,
    },
    /// Show how warm the surroundings are, by the heaters' own resistances, and have positions compensated for them, or not.
    #[command(after_long_help = "Example:\n  host-tool room off")]
    Room {
        /// `on`: positions are compensated for the surroundings, as after a reset; `off`: the mirror is left to them. Without
        /// it nothing changes.
        #[arg(value_name = "SWITCH")]
        compensate: Option<Switch>,
    },
    /// Drive the actuators with these voltages.
    #[command(after_long_help = "Example:\n  host-tool set-drive 1.9V 1.9V 1.8V 1.9V --settle 2s")]
    SetDrive {
        /// One voltage for all actuators, or one for each: 1.9V, or 1.9V 1.9V 1.8V 1.9V.
        #[arg(required = true)]
        drives: Vec<Voltage>,
        /// How long to let the mirror settle before reading it.
        #[arg(help_heading = SIGNAL, long, default_value = "1s")]
        settle: Span,
        /// How long the board holds them after that without being told again: 2s, 1h, forever. Then
        /// it ramps to zero. Without it 10min, or what the bench allows.
        #[arg(help_heading = SIGNAL, long)]
        hold: Option<Hold>,
    },
    /// Turn all channels off, whoever has the board.
    #[command(after_long_help = "Example:\n  host-tool off")]
    Off,
    /// Forget the faults that have turned the board off, so that it can be driven again.
    #[command(after_long_help = "Example:\n  host-tool clear")]
    Clear,
    /// Record what the board measures, without changing what it drives, nor for how long.
    #[command(
        after_long_help = "Example:\n  host-tool record -o idle.csv --duration 10s --period 5ms"
    )]
    Record {
        /// The measurement file to write; `-` is the standard output, for a program that reads it as it comes.
        #[arg(help_heading = OUTPUT, short, long)]
        output: PathBuf,
        /// How long, in the board's time.
        #[arg(help_heading = SIGNAL, long, default_value = "1s", value_parser = some(|span: &Span| span.s))]
        duration: Span,
        /// From one sample to the next: whole ticks of the board, of 0.1 ms.
        #[arg(help_heading = SIGNAL, long, default_value = "1ms")]
        period: Span,
        /// Replace the file if it exists.
        #[arg(help_heading = OUTPUT, long)]
        force: bool,
    },
    /// Measure the mirror with one of the paper's experiments; the channels are off afterwards.
    #[command(subcommand)]
    Measure(Measure),
    /// Move the mirror along a sine, a triangle, a figure of tilts or a waveform of your own; the channels are off
    /// afterwards.
    #[command(subcommand)]
    Scan(Scan),
    /// Identify the mirror and calibrate the board: measure, identify, build the tables, refine them, and try them at other
    /// positions, before and after.
    #[command(
        after_long_help = "Example:\n  host-tool calibrate --device mirror-7 --picture calibrate.svg"
    )]
    Calibrate(Calibrate),
    /// Calibrate the tilts of a calibrated board: poses are read under at least three spots of the sensor, which a person moves when asked, or by
    /// an instrument of two axes. A spot that is whole is kept; called again, it goes on with the next one.
    #[command(
        after_long_help = "Example:\n  host-tool calibrate-pose mirror-7.toml spots --spots corners.csv -o mirror-7-with-tilts.toml"
    )]
    CalibratePose(CalibratePose),
    /// Measure what a kelvin of the room is worth to this mirror: typed once, and once more where the room is at least 3 K
    /// warmer or colder, it makes a calibrated board's positions right in any room.
    #[command(
        after_long_help = "Example:\n  host-tool calibrate-room mirror-7.toml room.json -o mirror-7-in-any-room.toml"
    )]
    CalibrateRoom(CalibrateRoom),
    /// Use a calibration that `calibrate -o` wrote, from now on; all channels are off afterwards.
    #[command(after_long_help = "Example:\n  host-tool load-calibration mirror-7.toml")]
    LoadCalibration {
        /// The calibration file. It holds for the mirror that it was made with.
        file: PathBuf,
        /// Take it although the heaters on the board are another mirror's.
        #[arg(help_heading = BOARD, long)]
        other_mirror: bool,
    },
    /// Calibrate the board's current sense: its zero, with the mirror in place, and with a known resistor in the place of
    /// each actuator its gain; the channels are off afterwards.
    #[command(after_long_help = "Example:\n  host-tool calibrate-sense --resistor 499ohm")]
    CalibrateSense {
        /// The resistor that is connected to each channel in place of the mirror: 499ohm. 300 to 1000 ohm. What warms as a heater does, or is
        /// off by more than a board's tolerances, is refused.
        #[arg(help_heading = BOARD, long, value_name = "RESISTANCE")]
        resistor: Option<Resistance>,
        /// Go back to the gains of a board as designed, as the factory left it; the mirror may be in place.
        #[arg(help_heading = BOARD, long, conflicts_with = "resistor")]
        forget_gains: bool,
    },
    /// Be an instrument on a socket that speaks SCPI, for as long as it runs: Ctrl-C ends it.
    #[command(after_long_help = "Example:\n  host-tool serve --listen 127.0.0.1:5025")]
    Serve {
        /// Where to listen: an address of this machine and a port, 0 for any that is free. Whoever reaches it drives the
        /// mirror: 127.0.0.1 is reached from this machine only.
        #[arg(help_heading = BOARD, long, value_name = "ADDRESS", default_value = "127.0.0.1:5025")]
        listen: String,
        /// End when the standard input does, as it does with the program that started this.
        #[arg(help_heading = INPUT, long)]
        end_with_input: bool,
        /// Print what the instrument understands instead, as a page in Markdown.
        #[arg(help_heading = OUTPUT, long)]
        reference: bool,
    },
    /// Explain a fault or a limit: what it is, its cause, and its remedy; or an effect, or a word of a diagnosis.
    #[command(
        after_long_help = "Examples:\n  host-tool explain over-temperature\n  host-tool explain score"
    )]
    Explain {
        /// Its name, as `status` or `diagnose` shows it; without it, all names.
        #[arg(add = candidates::explained())]
        name: Option<String>,
    },
    /// Make a measurement file of a table from another program or instrument. Without -o it only shows what it would make.
    #[command(
        after_long_help = "Example:\n  host-tool import scope.csv --column z=height:nm:-1 -o sweep.csv"
    )]
    Import(Import),
    /// Fit a model's parameters to measurements.
    #[command(after_long_help = "Example:\n  host-tool fit paper session -o fitted.toml")]
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
    #[command(
        after_long_help = "Example:\n  host-tool identify reconciled session -o identified.toml"
    )]
    Identify {
        /// Model to start from, and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
    /// Show where a model fails: by experiment, by stage, and in sentences.
    #[command(
        after_long_help = "Example:\n  host-tool compare fitted.toml session --picture compare.svg"
    )]
    Compare(Compare),
    /// Say which physical effect a model lacks, or that these data cannot tell and what would.
    #[command(after_long_help = "Example:\n  host-tool diagnose fitted.toml session")]
    Diagnose(Diagnose),
    /// Write all of it into one page for a browser: curves, verdict with its evidence, effects to switch, and the data.
    #[command(
        after_long_help = "Example:\n  host-tool report session --model fitted.toml -o report.html"
    )]
    Report(Report),
    /// Repeat the run that a page of `report` shows, from what is inside it, and say whether it comes out the same.
    #[command(after_long_help = "Example:\n  host-tool replay report.html")]
    Replay {
        /// The page.
        page: PathBuf,
    },
    /// The physical effects that a model can have.
    #[command(subcommand)]
    Effect(EffectCommand),
    /// Print a completion script for a shell: commands, options, boards, effects, faults and presets.
    #[command(after_long_help = "Example:\n  host-tool completions bash")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

#[cfg(test)]
mod tests;
