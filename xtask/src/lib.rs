//! One task runner for the workspace: `cargo xtask help`.
//!
//! What builds, checks and tests is here. What plays with an emulated board or with virtual mirrors is in the `workbench`,
//! which this builds and starts: nobody waits for the lab to be built who wants to know how a task is called.

#[cfg(test)]
mod calibration;
pub mod cargo;
mod checks;
#[cfg(test)]
mod circles;
mod copy;
mod deny;
mod dist;
mod docs;
pub mod figures;
mod flash;
mod hil;
pub mod images;
#[cfg(test)]
mod layers;
mod mistakes;
#[cfg(test)]
mod names;
mod on_target;
mod packages;
mod page;
#[cfg(test)]
mod pages;
mod panics;
mod port;
#[cfg(test)]
mod profiles;
pub mod python;
mod sbom;
pub mod setup;
#[cfg(test)]
mod sharing;
#[cfg(test)]
mod sources;
mod test;
mod test_programs;
pub mod tool;
#[cfg(test)]
mod units;

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
    #[command(disable_help_flag = true)]
    Emulate(Words),
    /// Pass all tests: format, dependencies, lints, images, on target, host, end to end.
    Test {
        /// Also what is long: tests that are marked as ignored, the documentation, and the fuzzer.
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
    /// Build the example of a port to another PCB, and run it on that PCB's silicon twin.
    Port,
    /// Build the driver board's image with one mistake at a time in its drivers, and print which test on the silicon twin finds
    /// it: some half an hour.
    Mistakes,
    /// Measure what is claimed, and print it.
    #[command(disable_help_flag = true)]
    Bench(Words),
    /// Tell the whole story on a mirror with something hidden in it: measure, diagnose, calibrate, move; what was hidden comes
    /// last.
    #[command(disable_help_flag = true)]
    Story(Words),
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
    /// Build what people install: the sources as an archive, a wheel and a Debian package, with checksums and licences.
    Dist {
        /// Install each on a clean system too, and move a mirror there.
        #[arg(long)]
        check: bool,
    },
    /// Make a book of the pages of docs in target/docs, to be read and searched without a network.
    Docs {
        /// Try its links and, in a browser, its search.
        #[arg(long)]
        check: bool,
        /// Show it.
        #[arg(long)]
        open: bool,
    },
    /// Install the Python package into target/python, check its types, and test it and its drivers on emulated boards.
    Python {
        /// The notebook too, which takes minutes.
        #[arg(long)]
        full: bool,
    },
    /// Build a firmware image, print its size, and look for panics in the control tick.
    Build {
        /// The board to build for.
        #[arg(value_enum)]
        board: Board,
    },
    /// Build anew what `host-tool report` puts into its pages: the lab's code as WebAssembly.
    BuildPage,
    /// Write the sessions of data/hidden anew.
    HideEffects,
    /// Write anew what a board has until it is calibrated: the table of the reconciled model.
    TabulateFactory,
    /// Make the null ensembles anew that ship with the diagnosis: of the standard session and of those of `data/hidden`.
    TabulateEnsemble,
    /// Write anew what the diagnosis knows of effects that are taken for each other: 264 sessions, some twenty minutes.
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
        /// The ELF, and parts of the names of tests to run.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<String>,
    },
}

/// Words for the workbench.
#[derive(clap::Args)]
struct Words {
    /// What it takes (`--help`).
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<String>,
}

/// Does what the command line says.
pub fn main() -> ExitCode {
    run(Arguments::parse().task).unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(task: Task) -> Result<ExitCode> {
    match task {
        Task::Emulate(Words { words }) => workbench("emulate", &words),
        Task::Test { full } => test::run_all(full).map(|()| ExitCode::SUCCESS),
        Task::Hil {
            board: Some(board),
            resistors,
        } => hil::on_board(&board, resistors).map(|()| ExitCode::SUCCESS),
        Task::Hil { board: None, .. } => hil::on_emulated_boards().map(|()| ExitCode::SUCCESS),
        Task::Mistakes => mistakes::try_all().map(|()| ExitCode::SUCCESS),
        Task::Port => port::check().map(|()| ExitCode::SUCCESS),
        Task::Bench(Words { words }) => workbench("bench", &words),
        Task::Story(Words { words }) => workbench("story", &words),
        Task::Fuzz { arguments } => test::fuzz(&arguments).map(|()| ExitCode::SUCCESS),
        Task::Python { full } => python::check(full).map(|()| ExitCode::SUCCESS),
        Task::Docs { check, open } => docs::build(check, open).map(|()| ExitCode::SUCCESS),
        Task::Dist { check } => dist::build(check).map(|()| ExitCode::SUCCESS),
        Task::Deny => deny::check().map(|()| ExitCode::SUCCESS),
        Task::Sbom { folder } => sbom::write(&folder).map(|()| ExitCode::SUCCESS),
        Task::Build { board } => {
            tool::build()?;
            images::build(board)?;
            images::check(board).map(|()| ExitCode::SUCCESS)
        }
        Task::BuildPage => page::build().map(|()| ExitCode::SUCCESS),
        Task::LearnConfusions => workbench("learn-confusions", &[]),
        Task::HideEffects => workbench("hide-effects", &[]),
        Task::TabulateFactory => workbench("tabulate-factory", &[]),
        Task::TabulateEnsemble => workbench("tabulate-ensemble", &[]),
        Task::Flash { log } => flash::run_probe(log).map(|()| ExitCode::SUCCESS),
        Task::RunOnTarget { words } => {
            setup::qemu()?;
            workbench("run-on-target", &words)
        }
    }
}

/// Builds the workbench and has it do a task.
fn workbench(task: &str, words: &[String]) -> Result<ExitCode> {
    tool::build()?;
    let status = tool::workbench().arg(task).args(words).status()?;
    Ok(ExitCode::from(status.code().map_or(1, |code| code as u8)))
}
