//! `scan`, `calibrate`, `calibrate-pose` and `calibrate-room`: what moves the mirror for long.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use control_core::design::COLD_RESISTANCES_OHM;
use quantities::{Angle, Frequency, Length, QuantityError, Resistance, Span};

use super::heading::{BOARD, INPUT, OUTPUT, SIGNAL};
use super::measure::lag;
use super::whole::whole;
use crate::completion::candidates;

/// The waveforms of positions and poses.
#[derive(Debug, Subcommand)]
pub enum Scan {
    /// A sine from its middle upwards.
    #[command(
        after_long_help = "Example:\n  host-tool scan sine --offset 80um --amplitude 20um --frequency 5Hz"
    )]
    Sine {
        /// Its numbers.
        #[command(flatten)]
        curve: Curve,
        /// Tilts in step with it.
        #[command(flatten)]
        tilts: TiltCurve,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
    /// Straight lines from the middle up, down and back.
    #[command(
        after_long_help = "Example:\n  host-tool scan triangle --offset 60um --amplitude 20um --frequency 20Hz -o scan.csv"
    )]
    Triangle {
        /// Its numbers.
        #[command(flatten)]
        curve: Curve,
        /// Tilts in step with it.
        #[command(flatten)]
        tilts: TiltCurve,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
    /// The plate's normal along a cone: both tilts as sines, a quarter of a turn apart.
    #[command(
        after_long_help = "Example:\n  host-tool scan circle --offset 80um --radius 0.05deg --frequency 5Hz"
    )]
    Circle {
        /// Its piston and pace.
        #[command(flatten)]
        frame: Frame,
        /// Of the circle.
        #[arg(help_heading = SIGNAL, long)]
        radius: Angle,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
    /// Both tilts as sines with whole turns in a frame: a Lissajous figure.
    #[command(
        after_long_help = "Example:\n  host-tool scan lissajous --tilt-x 0.05deg --tilt-y 0.05deg --turns-x 3 --turns-y 4 --frequency 1Hz"
    )]
    Lissajous {
        /// Its piston and pace.
        #[command(flatten)]
        frame: Frame,
        /// Amplitude of the tilt about x.
        #[arg(help_heading = SIGNAL, long)]
        tilt_x: Angle,
        /// Amplitude of the tilt about y.
        #[arg(help_heading = SIGNAL, long)]
        tilt_y: Angle,
        /// Turns about x in a frame.
        #[arg(help_heading = SIGNAL, long, default_value_t = 3, value_parser = whole(1..=1000_u16))]
        turns_x: u16,
        /// Turns about y in a frame.
        #[arg(help_heading = SIGNAL, long, default_value_t = 4, value_parser = whole(1..=1000_u16))]
        turns_y: u16,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
    /// Lines about x, to and fro, while the plate turns slowly about y: up in one frame, down in the next.
    #[command(
        after_long_help = "Example:\n  host-tool scan raster --tilt-x 0.05deg --tilt-y 0.05deg --lines 64 --frequency 0.5Hz -o raster.csv"
    )]
    Raster {
        /// Its piston and pace; a cycle is two frames.
        #[command(flatten)]
        frame: Frame,
        /// Half of a line, a tilt about x.
        #[arg(help_heading = SIGNAL, long)]
        tilt_x: Angle,
        /// Half of a frame, a tilt about y.
        #[arg(help_heading = SIGNAL, long)]
        tilt_y: Angle,
        /// Lines in a frame.
        #[arg(help_heading = SIGNAL, long, default_value_t = 32, value_parser = whole(1..=1000_u16))]
        lines: u16,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
    /// Straight lines from point to point, or from pose to pose.
    #[command(
        after_long_help = "Examples:\n  host-tool scan csv path.csv --cycles 10\n  host-tool scan csv poses.csv -o scan.csv"
    )]
    Csv {
        /// Lines of seconds and micrometres; with a header, columns t_s, z_um, tilt_x_deg (or tip_deg), tilt_y_deg (or tilt_deg).
        file: PathBuf,
        /// How often it is gone through.
        #[arg(help_heading = SIGNAL, long, default_value_t = 1, value_parser = whole(1..=1_000_000_u32))]
        cycles: u32,
        /// Where the samples go.
        #[command(flatten)]
        to: ScanOutput,
    },
}

/// Tilts that go up and down with the piston.
#[derive(Debug, Args)]
pub struct TiltCurve {
    /// Amplitude of the tilt about x, beside the piston's.
    #[arg(help_heading = SIGNAL, long, default_value = "0deg", allow_hyphen_values = true)]
    pub tilt_x: Angle,
    /// Amplitude of the tilt about y.
    #[arg(help_heading = SIGNAL, long, default_value = "0deg", allow_hyphen_values = true)]
    pub tilt_y: Angle,
    /// Middle of the tilt about x.
    #[arg(help_heading = SIGNAL, long, default_value = "0deg", allow_hyphen_values = true)]
    pub middle_x: Angle,
    /// Middle of the tilt about y.
    #[arg(help_heading = SIGNAL, long, default_value = "0deg", allow_hyphen_values = true)]
    pub middle_y: Angle,
}

/// A figure of tilts, at a piston that is held.
#[derive(Debug, Args)]
pub struct Frame {
    /// The piston.
    #[arg(help_heading = SIGNAL, long, default_value = "80um")]
    pub offset: Length,
    /// Frames a second.
    #[arg(help_heading = SIGNAL, long, default_value = "1Hz")]
    pub frequency: Frequency,
    /// How often it is gone through.
    #[arg(help_heading = SIGNAL, long, default_value_t = 3, value_parser = whole(1..=1_000_000_u32))]
    pub cycles: u32,
}

/// A waveform that repeats.
#[derive(Debug, Args)]
pub struct Curve {
    /// Its middle.
    #[arg(help_heading = SIGNAL, long, default_value = "80um")]
    pub offset: Length,
    /// From its middle to its top.
    #[arg(help_heading = SIGNAL, long, default_value = "20um")]
    pub amplitude: Length,
    /// Cycles a second.
    #[arg(help_heading = SIGNAL, long, default_value = "1Hz")]
    pub frequency: Frequency,
    /// How many.
    #[arg(help_heading = SIGNAL, long, default_value_t = 3, value_parser = whole(1..=1_000_000_u32))]
    pub cycles: u32,
}

/// The measurement file of a scan.
#[derive(Debug, Args)]
pub struct ScanOutput {
    /// Keep the samples in this measurement file.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

impl ScanOutput {
    /// The file, if there is to be one, and whether it may be replaced.
    pub fn file(self) -> Option<(PathBuf, bool)> {
        self.output.map(|path| (path, self.force))
    }
}

/// What a calibration reads displacements by.
#[derive(Debug, Args)]
pub struct DisplacementSensor {
    /// Where displacements come from: `board`, or a serial sensor such as /dev/ttyACM0 or
    /// /dev/ttyUSB0@115200.
    #[arg(help_heading = BOARD, long, default_value = "board", value_name = "SENSOR")]
    pub sensor: String,
}

/// What a calibration takes, and leaves.
#[derive(Debug, Args)]
pub struct Calibrate {
    /// The model to start from: a file, or a preset (paper, paper-refit, reconciled).
    #[arg(default_value = "reconciled", add = candidates::models())]
    pub model: String,
    /// Identify from the measurements in this folder, instead of measuring anew.
    #[arg(help_heading = INPUT, long, value_name = "FOLDER")]
    pub from: Option<PathBuf>,
    /// Keep the measurement files in this folder.
    #[arg(help_heading = OUTPUT, long, value_name = "FOLDER", conflicts_with = "from")]
    pub keep: Option<PathBuf>,
    /// Also write the calibration to this file.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Also write the identified model to this file.
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub model_output: Option<PathBuf>,
    /// Draw error, step and loop before and after, as SVG.
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Also write what the board reached before and after, with the calibration, to this file, for `report --trial`.
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub trial: Option<PathBuf>,
    /// Fewer moves to refine it by and to try it with: two thirds of the time, and a little coarser.
    #[arg(help_heading = SIGNAL, long)]
    pub quick: bool,
    /// What to call the mirror; without it, as the board is called.
    #[arg(help_heading = BOARD, long, value_name = "NAME")]
    pub device: Option<String>,
    /// What an ohmmeter says of a cold heater, 310 to 450 ohm: for a mirror that the board turns off before it is calibrated, since its heaters
    /// are far from the factory's 360 ohm. Until then they are watched as heaters of this resistance.
    #[arg(help_heading = BOARD, long, value_name = "RESISTANCE", value_parser = cold_resistance)]
    pub cold_resistance: Option<Resistance>,
    /// What reads displacements.
    #[command(flatten)]
    pub displacements: DisplacementSensor,
    /// How late that sensor tells what it reads; it is taken out of the displacements. The mirror's own lag looks the same,
    /// so name what the sensor's maker states.
    #[arg(help_heading = BOARD, long, default_value = "0ms", value_name = "TIME", value_parser = lag)]
    pub sensor_lag: Span,
    /// Replace files that exist.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What a board allows (`control_core::design`).
fn cold_resistance(text: &str) -> Result<Resistance, String> {
    let resistance: Resistance = text
        .parse()
        .map_err(|error: QuantityError| error.to_string())?;
    let (least, most) = COLD_RESISTANCES_OHM.into_inner();
    match (f64::from(least)..=f64::from(most)).contains(&resistance.ohm) {
        true => Ok(resistance),
        false => Err(format!(
            "a heater that this board drives has {least} to {most} ohm"
        )),
    }
}

/// `calibrate-pose`
#[derive(Debug, Args)]
pub struct CalibratePose {
    /// The calibration that the board uses, as `calibrate -o` wrote it.
    pub calibration: PathBuf,
    /// Folder that keeps what was read under each spot, for the next call too.
    #[arg(default_value = "pose-spots")]
    pub session: PathBuf,
    /// Where the sensor's spot goes on the plate: lines of x and y in micrometres from its centre, at least three, not on a line.
    /// Without it they are asked for.
    #[arg(help_heading = INPUT, long, value_name = "FILE")]
    pub spots: Option<PathBuf>,
    /// What an instrument of two axes has read instead, under assumed levers or those of the calibration: a table with the columns
    /// asked_z_um, asked_tilt_x_deg, asked_tilt_y_deg, held_s, z_um, tilt_x_deg, tilt_y_deg. Nothing is moved.
    #[arg(help_heading = INPUT, long, value_name = "FILE", conflicts_with = "spots")]
    pub from: Option<PathBuf>,
    /// Also write the calibration that comes of it to this file.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How long to let the plate settle in each pose.
    #[arg(help_heading = SIGNAL, long, default_value = "2s", value_name = "TIME")]
    pub settle: Span,
    /// What reads displacements.
    #[command(flatten)]
    pub displacements: DisplacementSensor,
    /// Replace the file of -o if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// `calibrate-room`
#[derive(Debug, Args)]
pub struct CalibrateRoom {
    /// The calibration that the board uses, as `calibrate -o` wrote it.
    pub calibration: PathBuf,
    /// Keeps what was read in the first room for the second; leave mirror and sensor as they are in between.
    pub readings: PathBuf,
    /// Also write the calibration that comes of it to this file.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How long to let the mirror settle at each position.
    #[arg(help_heading = SIGNAL, long, default_value = "2s", value_name = "TIME")]
    pub settle: Span,
    /// What reads displacements.
    #[command(flatten)]
    pub displacements: DisplacementSensor,
    /// Replace the file of -o if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}
