//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::quantity::{Length, Span, Voltage};

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
    /// Show who the board is and what it is doing.
    Status,
    /// Move the mirror to a position and print what it took.
    SetZ {
        /// Where to, from rest and towards the substrate: 120um, 0.12mm.
        #[arg(allow_hyphen_values = true)]
        z: Length,
        /// How long to let the mirror settle before reading it.
        #[arg(long, default_value = "1s")]
        settle: Span,
    },
    /// Drive the actuators with these voltages.
    SetDrive {
        /// One voltage for all actuators, or one for each: 1.9V, or 1.9V 1.9V 1.8V 1.9V.
        #[arg(required = true)]
        drives: Vec<Voltage>,
        /// How long to let the mirror settle before reading it.
        #[arg(long, default_value = "1s")]
        settle: Span,
    },
    /// Turn all channels off.
    Off,
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
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}
