//! What `cargo xtask` does with emulated boards and virtual mirrors.

mod bench;
mod coverage;
mod diagnoses;
mod emulate;
mod ensembles;
mod factory;
mod foreign;
mod hidden;
mod missing_physics;
mod on_target;
mod package;
mod picture;
mod poses;
mod positions;
mod story;
mod traces;
mod twin_speed;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// What is done with emulated boards and virtual mirrors.
#[derive(Parser)]
#[command(bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run the host tool against an emulated board with a virtual mirror; without arguments, keep
    /// the board up for many commands.
    Emulate(mirror_emulator::Arguments),
    /// Measure what is claimed, and print it.
    Bench {
        /// What to measure; without it, the board and the control tick.
        #[arg(value_enum)]
        what: Option<Benchmark>,
        /// What else the measuring takes (`bench diagnose -- --help`).
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Tell the whole story on a mirror with something hidden in it: measure, diagnose, calibrate, move.
    Story(story::StoryArguments),
    /// Write the sessions of data/hidden anew.
    HideEffects,
    /// Write anew what a board has until it is calibrated: the table of the reconciled model.
    TabulateFactory,
    /// Write anew the null ensembles that ship, of the standard session and of those of `data/hidden`: a minute.
    TabulateEnsemble,
    /// Write anew what the diagnosis knows of effects that are taken for each other: 264 sessions, some twenty minutes.
    LearnConfusions,
    /// Write what `host-tool update` takes beside an ELF of the driver board's firmware.
    Package {
        /// The ELF.
        elf: PathBuf,
        /// Replace what is there.
        #[arg(long)]
        force: bool,
    },
    /// Write manual pages of host-tool.
    Man {
        /// The folder.
        folder: PathBuf,
    },
    /// Run an ELF of on-target tests under QEMU.
    RunOnTarget {
        /// The ELF.
        elf: PathBuf,
        /// Only tests whose name contains one of these.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        filters: Vec<String>,
    },
}

/// What can be measured besides.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Benchmark {
    /// How well the diagnosis finds what is hidden in virtual mirrors: 324 sessions a seed.
    Diagnose,
    /// What other people's methods find in the same mirrors: a data set, and one score for all.
    MissingPhysics,
    /// What positioning reaches on virtual mirrors, and on foreign ones.
    Position,
    /// What positioning reaches on mirrors of other equations than the project's own.
    Foreign,
    /// Power cuts that a stored calibration survives, and how the flash wears.
    Store,
    /// How much of the flashed image's code the silicon twin executes.
    Coverage,
    /// What an oscilloscope shows at the driver board's actuators, as pictures.
    Traces,
    /// How fast the silicon twin is, and what it spends the time on.
    Twin,
}

fn main() -> ExitCode {
    run(Arguments::parse().task).unwrap_or_else(|error| {
        eprintln!("error: {}", mirror_emulator::told(&error));
        ExitCode::FAILURE
    })
}

fn run(task: Task) -> Result<ExitCode> {
    match task {
        Task::Emulate(arguments) => return emulate::run(&arguments),
        Task::RunOnTarget { elf, filters } => return on_target::run_elf(&elf, &filters),
        Task::Bench { what, arguments } => match what {
            None => bench::run(),
            Some(Benchmark::Diagnose) => diagnoses::count(&arguments),
            Some(Benchmark::MissingPhysics) => missing_physics::compare(&arguments),
            Some(Benchmark::Position) => positions::run().and_then(|()| foreign::run(&arguments)),
            Some(Benchmark::Foreign) => foreign::run(&arguments),
            Some(Benchmark::Store) => bench::store(),
            Some(Benchmark::Coverage) => coverage::run(),
            Some(Benchmark::Traces) => traces::draw(),
            Some(Benchmark::Twin) => twin_speed::run(),
        },
        Task::Story(arguments) => story::run(&arguments),
        Task::HideEffects => hidden::write(),
        Task::TabulateFactory => factory::write(),
        Task::TabulateEnsemble => ensembles::write(),
        Task::LearnConfusions => diagnoses::learn(),
        Task::Package { elf, force } => package::write(&elf, force),
        Task::Man { folder } => package::write_manual(&folder),
    }?;
    Ok(ExitCode::SUCCESS)
}
