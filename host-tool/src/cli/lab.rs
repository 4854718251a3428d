//! The words of the model lab.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::heading::OUTPUT;
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
