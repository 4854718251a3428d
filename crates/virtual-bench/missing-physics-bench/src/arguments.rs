//! What is asked for on the command line.

use clap::{Parser, ValueEnum};
use std::path::PathBuf;

/// What is tried.
#[derive(Parser)]
pub(crate) struct Arguments {
    /// Mirrors a kind of session: one seed is 324 sessions, some twenty minutes on two idle cores.
    #[arg(long, default_value_t = 1)]
    pub(crate) seeds: u64,
    /// The first seed: figures to be believed come from seeds that nobody developed on.
    #[arg(long, default_value_t = 1000)]
    pub(crate) first_seed: u64,
    /// Hide this only: an effect, `nothing`, or `two`. Each best explanation is printed with its rivals.
    #[arg(long)]
    pub(crate) only: Option<String>,
    /// Strengths of a single hidden effect.
    #[arg(long, value_delimiter = ',', default_value = "0.3,1,3")]
    pub(crate) strengths: Vec<f64>,
    /// White noise of the displacement (nm).
    #[arg(long, value_delimiter = ',', default_value = "10,50")]
    pub(crate) noises: Vec<f64>,
    /// Mirrors of each family with nothing hidden, a seed and a kind of session.
    #[arg(long, default_value_t = 2)]
    pub(crate) nothing: usize,
    /// Mirrors are made to a design of their family, and the diagnosis is told the design with its tolerances.
    #[arg(long)]
    pub(crate) described: bool,
    /// Only sessions with these instruments.
    #[arg(long, value_enum)]
    pub(crate) instruments: Option<Instruments>,
    /// Hides effects in mirrors of the families that thresholds are calibrated on instead, and writes what is taken for what
    /// and how far sizes are off to this file: the table that the diagnosis ships with.
    #[arg(long)]
    pub(crate) learn: Option<PathBuf>,
    /// Writes sessions as a data set for other methods into this folder instead of diagnosing them: `--first-seed` and `--seeds`
    /// choose the mirrors that are tested on.
    #[arg(long, value_name = "DIR")]
    pub(crate) export: Option<PathBuf>,
    /// Counts how often the stage is found to which what is hidden belongs, on another author's mirror too; `--learn` then
    /// writes the table of confidences.
    #[arg(long)]
    pub(crate) whereabouts: bool,
    /// Where null ensembles are kept.
    #[arg(long, default_value = "target/diagnosis-cache")]
    pub(crate) cache: PathBuf,
}

/// What the bench reads besides the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Instruments {
    /// Displacement and currents.
    With,
    /// Displacement only.
    Without,
    /// Displacement and currents, after the standard session in an oven at two temperatures and with reference steps.
    WithOvenAndStage,
    /// Displacement and currents of one sweep.
    Sweep,
    /// Currents of one sweep, as of a heater on a bench.
    SweepOfCurrents,
}

impl Instruments {
    /// Those that are tried unless one is asked for.
    const USUAL: [Self; 2] = [Self::With, Self::Without];

    pub(crate) fn tried(only: Option<Self>) -> Vec<Self> {
        only.map_or(Self::USUAL.to_vec(), |only| vec![only])
    }

    /// The largest set of effects that says something.
    pub(crate) fn set(self) -> usize {
        match self {
            Self::With | Self::WithOvenAndStage => 2,
            Self::Without | Self::Sweep | Self::SweepOfCurrents => 3,
        }
    }
}
