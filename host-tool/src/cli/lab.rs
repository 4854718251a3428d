//! The words of the model lab.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::heading::{INPUT, OUTPUT};
use crate::completion::candidates;

/// A model and what was measured.
#[derive(Debug, Args)]
pub struct LabInput {
    /// A model file, or a preset: paper, paper-refit, reconciled.
    #[arg(add = candidates::models())]
    pub model: String,
    /// Measurement files, or folders of them; together they are one session.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
}

/// Where a model is written.
#[derive(Debug, Args)]
pub struct ModelOutput {
    /// The model file to write.
    #[arg(help_heading = OUTPUT, short, long, value_name = "MODEL")]
    pub output: PathBuf,
    /// Replace the file if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What `import` makes of a table.
#[derive(Debug, Args)]
pub struct Import {
    /// The table: CSV or other text, with whatever delimiter, decimal sign and encoding; a spreadsheet; NumPy's .npy or .npz.
    pub file: PathBuf,
    /// What a column is, where its name does not say it: QUANTITY=NAME:UNIT:FACTOR, unit and factor as needed, or the
    /// column's number for its name. Quantities are t, V or V1 to V4, I or I1 to I4, z, T_ambient, tilt_x, tilt_y, reference.
    #[arg(help_heading = INPUT, long, value_name = "ASSIGNMENT")]
    pub column: Vec<String>,
    /// Rows at one drive are samples of one settled reading: take their mean, and leave times out.
    #[arg(help_heading = INPUT, long)]
    pub settled: bool,
    /// Of a table that holds several runs, in each of which the time begins anew, the run of this number, from 1.
    #[arg(help_heading = INPUT, long, value_name = "NUMBER")]
    pub run: Option<usize>,
    /// The measurement file to write.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What `compare` is asked.
#[derive(Debug, Args)]
pub struct Compare {
    /// Model and measurements.
    #[command(flatten)]
    pub lab: LabInput,
    /// Draw measured and modelled curves and what is left between them, as SVG.
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Replace the picture if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What `diagnose` is asked.
#[derive(Debug, Args)]
pub struct Diagnose {
    /// Model and measurements.
    #[command(flatten)]
    pub lab: LabInput,
    /// Also try this effect of your own, a TOML file as `effect new` writes it.
    #[arg(help_heading = INPUT, long, value_name = "FILE")]
    pub effect: Vec<PathBuf>,
    /// Also say which fact of the mirror, stated in `[device]` of the model file, would show most: takes some minutes the first
    /// time.
    #[arg(help_heading = OUTPUT, long)]
    pub facts: bool,
    /// Also say which further measurement would show most: takes some minutes the first time.
    #[arg(help_heading = OUTPUT, long)]
    pub measurements: bool,
    /// Where no known effect explains what is left and a formula is proposed, write it to this file, as `effect add` takes it.
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub propose: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What `report` writes.
#[derive(Debug, Args)]
pub struct Report {
    /// Measurement files, or folders of them; together they are one session.
    #[arg(required = true, value_name = "SESSION")]
    pub files: Vec<PathBuf>,
    /// A model file, or a preset: paper, paper-refit, reconciled.
    #[arg(help_heading = INPUT, long, default_value = "paper", value_name = "MODEL", add = candidates::models())]
    pub model: String,
    /// Also try this effect of your own, a TOML file as `effect new` writes it.
    #[arg(help_heading = INPUT, long, value_name = "FILE")]
    pub effect: Vec<PathBuf>,
    /// Also show the board, its calibration and what it reached before and after: a file that `calibrate --trial` wrote.
    #[arg(help_heading = INPUT, long, value_name = "FILE")]
    pub trial: Option<PathBuf>,
    /// The page to write.
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Replace the page if it exists.
    #[arg(help_heading = OUTPUT, long)]
    pub force: bool,
}

/// What can be done with effects.
#[derive(Debug, Subcommand)]
pub enum EffectCommand {
    /// List them, in the order of the stages.
    #[command(after_long_help = "Example:\n  host-tool effect list")]
    List,
    /// Tell what one is, its equation, how it shows, and what separates it from others.
    #[command(after_long_help = "Example:\n  host-tool effect show creep")]
    Show {
        /// Its id.
        #[arg(add = candidates::effects())]
        id: String,
    },
    /// Write a file to describe an effect of your own in.
    #[command(after_long_help = "Example:\n  host-tool effect new -o mine.toml")]
    New {
        /// The file to write.
        #[arg(help_heading = OUTPUT, short, long, value_name = "FILE")]
        output: PathBuf,
        /// Replace the file if it exists.
        #[arg(help_heading = OUTPUT, long)]
        force: bool,
    },
    /// Add one to a model, refit, and print the error before and after.
    #[command(
        after_long_help = "Example:\n  host-tool effect add creep paper session -o with-creep.toml"
    )]
    Add {
        /// Its id, or the file of an effect of your own.
        #[arg(add = candidates::effects())]
        effect: String,
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
    /// Take one out of a model, refit, and print the error before and after.
    #[command(
        after_long_help = "Example:\n  host-tool effect remove creep with-creep.toml session -o without.toml"
    )]
    Remove {
        /// Its id.
        #[arg(add = candidates::effects())]
        effect: String,
        /// Model and measurements.
        #[command(flatten)]
        lab: LabInput,
        /// The model that comes out.
        #[command(flatten)]
        output: ModelOutput,
    },
}
