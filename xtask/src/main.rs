//! One task runner for the workspace: `cargo xtask help`.

mod bench;
mod cargo;
mod deny;
mod diagnoses;
mod emulate;
mod figures;
mod flash;
mod hidden;
mod hil;
mod images;
#[cfg(test)]
mod layers;
mod on_target;
mod packages;
mod panics;
mod picture;
mod positions;
mod sbom;
mod setup;
#[cfg(test)]
mod sharing;
mod test;
mod test_programs;
mod tool;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::images::Board;

/// Everything that is done with this workspace.
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
    Emulate(emulate::Arguments),
    /// Pass all tests: format, dependencies, lints, images, on target, host, end to end, docs.
    Test {
        /// Also what is long: tests that are marked as ignored, and the fuzzer.
        #[arg(long)]
        full: bool,
    },
    /// Check a board for acceptance: the one named, or an emulated one.
    Hil {
        /// The board, as `host-tool list` names it. Skipped where it is not there.
        #[arg(long)]
        board: Option<String>,
        /// Resistors of so many ohms are on all channels of that board in place of the mirror: tries drive and sense
        /// against them, and calibrates the sense.
        #[arg(long, requires = "board", value_name = "OHM")]
        resistors: Option<f64>,
    },
    /// Measure what is claimed, and print it.
    Bench {
        /// What to measure; without it, the board and the control tick.
        #[arg(value_enum)]
        what: Option<Benchmark>,
        /// What else the measuring takes (`bench diagnose -- --help`).
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Feed mutated input to everything that reads bytes or text from outside.
    Fuzz {
        /// Cases, and what else the fuzzer takes (`--help`).
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Check licences, sources and duplicates of everything that is built, by deny.toml; with cargo-deny, advisories too.
    Deny,
    /// Write what tool and firmware are made of, as CycloneDX, into a folder.
    Sbom {
        /// The folder; made where it is missing.
        #[arg(default_value = "target/sbom")]
        folder: PathBuf,
    },
    /// Build a firmware image, print its size, and look for panics in the control tick.
    Build {
        /// The board to build for.
        #[arg(value_enum)]
        board: Board,
    },
    /// Write the sessions of data/hidden anew.
    HideEffects,
    /// Write anew what the diagnosis knows of effects that are taken for each other: 480 sessions, some twenty minutes.
    LearnConfusions,
    /// Write the firmware to a connected driver board, with probe-rs.
    Flash {
        /// Stay connected and print the firmware's log (defmt over RTT) until Ctrl-C. `DEFMT_LOG=debug` at the time of the
        /// build says how much of it there is.
        #[arg(long)]
        log: bool,
    },
    /// Run an ELF of on-target tests under QEMU (cargo's runner for the target).
    #[command(hide = true)]
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
    /// What positioning reaches on virtual mirrors.
    Position,
    /// Power cuts that a stored calibration survives, and how the flash wears.
    Store,
}

fn main() -> ExitCode {
    run(Arguments::parse().task).unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(task: Task) -> Result<ExitCode> {
    match task {
        Task::Emulate(arguments) => emulate::run(&arguments),
        Task::Test { full } => test::run_all(full).map(|()| ExitCode::SUCCESS),
        Task::Hil {
            board: Some(board),
            resistors,
        } => hil::on_board(&board, resistors).map(|()| ExitCode::SUCCESS),
        Task::Hil { board: None, .. } => hil::on_emulated_boards().map(|()| ExitCode::SUCCESS),
        Task::Bench { what: None, .. } => bench::run().map(|()| ExitCode::SUCCESS),
        Task::Bench {
            what: Some(Benchmark::Diagnose),
            arguments,
        } => diagnoses::count(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Bench {
            what: Some(Benchmark::Store),
            ..
        } => bench::store().map(|()| ExitCode::SUCCESS),
        Task::Fuzz { arguments } => test::fuzz(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Bench {
            what: Some(Benchmark::Position),
            ..
        } => positions::run().map(|()| ExitCode::SUCCESS),
        Task::Deny => deny::check().map(|()| ExitCode::SUCCESS),
        Task::Sbom { folder } => sbom::write(&folder).map(|()| ExitCode::SUCCESS),
        Task::Build { board } => images::build_and_check(board).map(|()| ExitCode::SUCCESS),
        Task::LearnConfusions => diagnoses::learn().map(|()| ExitCode::SUCCESS),
        Task::HideEffects => hidden::write().map(|()| ExitCode::SUCCESS),
        Task::Flash { log } => flash::run_probe(log).map(|()| ExitCode::SUCCESS),
        Task::RunOnTarget { elf, filters } => on_target::run_elf(&elf, &filters),
    }
}
