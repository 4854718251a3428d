//! Everything that must pass before code is shared.
//!
//! The steps share their builds: all that runs on this machine is built once, by the linter, which is the compiler with more
//! to say; all that runs on the target once in the firmware's profile, by the compiler that makes what is flashed.

use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use crate::cargo::{ON_HOST, TARGET, cargo, run};
use crate::deny;
use crate::hil;
use crate::images::{self, Board};
use crate::setup;
use crate::test_programs::{self, TestProgram};
use crate::tool;

const FIRMWARE: &str = "mirror-firmware";
/// Suites of on-target tests.
const ON_TARGET: [&str; 3] = ["approximations", "core", "protocol"];

/// What the test runner must make of `tests/runner.rs`, whose tests fail on purpose.
const RUNNER_OUTCOMES: [&str; 6] = [
    "test faults ... FAILED",
    "test hangs ... FAILED (it hangs)",
    "test panics ... FAILED",
    "test panics_as_it_should ... ok",
    "test passes ... ok",
    "test result: FAILED. 2 passed; 3 failed",
];

/// The program of tests that takes the longest.
const LONGEST: &str = "tests/lab";

/// Programs of tests that take less are not told one by one.
const TOLD: Duration = Duration::from_secs(5);

/// Set for the long run: tests read it to choose how much they try.
const FULL: &str = "MIRROR_FULL";

/// The steps that have passed, and how long each took.
struct Gate {
    full: bool,
    passed: Vec<(String, Duration)>,
}

impl Gate {
    /// Runs a step, or fails with its name.
    fn step<T>(&mut self, name: &str, step: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        eprintln!("\n== {name}");
        let start = Instant::now();
        let result = step(self).with_context(|| format!("step `{name}`"))?;
        self.passed.push((name.to_owned(), start.elapsed()));
        Ok(result)
    }

    /// Runs programs of tests, as many at a time as there are processors, each on one: an emulated board and its mirror
    /// take turns, and so do a tool and its board. What a program says is printed once it has ended.
    fn run(&mut self, programs: &[TestProgram]) -> Result<()> {
        let next = AtomicUsize::new(0);
        let (send, ended) = channel();
        let this = &*self;
        let ended: Vec<_> = thread::scope(|scope| {
            for processor in processors() {
                let send = send.clone();
                let next = &next;
                scope.spawn(move || {
                    // Programs inherit it. Where the system does not let it, the tests are slower and nothing else.
                    let _ = sched_setaffinity(None, &processor);
                    while let Some(program) = programs.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let start = Instant::now();
                        let output = this.command(program).output();
                        if send.send((program, output, start.elapsed())).is_err() {
                            return;
                        }
                    }
                });
            }
            drop(send);
            ended
                .into_iter()
                .inspect(|(program, output, _)| print_output(program, output))
                .collect()
        });
        let mut failed = Vec::new();
        for (program, output, took) in ended {
            let output = output.with_context(|| format!("{} does not run", program.name))?;
            if !output.status.success() {
                failed.push(format!("{} of {}", program.name, program.package));
            }
            self.note(program, took);
        }
        ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
        Ok(())
    }

    fn command(&self, program: &TestProgram) -> Command {
        let mut command = program.command();
        if self.full {
            command.arg("--include-ignored").env(FULL, "1");
        }
        command
    }

    /// Keeps the time of a long one.
    fn note(&mut self, program: &TestProgram, took: Duration) {
        if took >= TOLD {
            let name = format!("  {} {}", program.package, program.name);
            self.passed.push((name, took));
        }
    }

    fn print(&self, all: Duration) {
        println!("\nPassed, in seconds:");
        for (name, took) in &self.passed {
            println!("{:>6.0}  {name}", took.as_secs_f64());
        }
        println!("{:>6.0}  all", all.as_secs_f64());
    }
}

/// Passes all tests, with `full` the long ones too, or stops at the first step that fails.
pub(crate) fn run_all(full: bool) -> Result<()> {
    setup::rust_target()?;
    setup::rust_components()?;
    setup::qemu()?;
    let start = Instant::now();
    let mut gate = Gate {
        full,
        passed: Vec::new(),
    };
    gate.step("format", |_| format())?;
    gate.step("licences, sources and duplicates", |_| deny::check())?;
    let mut programs = gate.step("build of tool and tests, and their lints", |_| {
        test_programs::build_and_lint()
    })?;
    gate.step(
        "images: their size, and no panic in the control tick",
        |_| {
            images::build_and_check(Board::Stm32g474)?;
            images::build_and_check(Board::Mps2)
        },
    )?;
    gate.step("lints of the firmware", |_| lints())?;
    gate.step("tests on the target", |_| on_target())?;
    // The longest first, so that no processor waits at the end.
    programs.sort_by_key(|program| (program.name != LONGEST, program.package != hil::PACKAGE));
    gate.step("tests on the host and on emulated boards", |gate| {
        gate.run(&programs)?;
        hil::name_real_boards()
    })?;
    gate.step("acceptance checks on the silicon twin", |_| {
        let mut programs = programs.iter();
        let checks = programs.find(|program| program.name == "tests/acceptance");
        let checks = checks.context("the acceptance checks were not built")?;
        let mut command = checks.command();
        run(command.env("MIRROR_EMULATOR", "g474"))
    })?;
    if full {
        gate.step("documentation, and the examples in it", |_| documentation())?;
        gate.step("fuzzing", |_| fuzz(&[]))?;
    }
    gate.print(start.elapsed());
    Ok(())
}

/// Each processor that this process may use, by itself.
fn processors() -> Vec<CpuSet> {
    let all = sched_getaffinity(None).unwrap_or_else(|_| only(0));
    let numbers = (0..CpuSet::MAX_CPU).filter(|number| all.is_set(*number));
    numbers.map(only).collect()
}

fn only(number: usize) -> CpuSet {
    let mut set = CpuSet::new();
    set.set(number);
    set
}

fn print_output(program: &TestProgram, output: &std::io::Result<Output>) {
    println!("\n> {} of {}", program.name, program.package);
    if let Ok(output) = output {
        print!("{}", String::from_utf8_lossy(&output.stdout));
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// The fuzzer, with every check that a debug build makes.
pub(crate) fn fuzz(arguments: &[String]) -> Result<()> {
    let fuzzer = ["run", "--profile", "fuzz", "--package", "fuzz", "--"];
    run(cargo(&fuzzer).args(arguments))
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

/// Lints the firmware with each board.
fn lints() -> Result<()> {
    let deny = ["--", "-D", "warnings"];
    run(for_board("clippy", Board::Stm32g474)
        .args(["--lib", "--bins"])
        .args(deny))?;
    run(for_board("clippy", Board::Mps2)
        .args(["--all-targets"])
        .args(deny))
}

fn on_target() -> Result<()> {
    for suite in ON_TARGET {
        run(&mut on_target_suite(suite))?;
    }
    let output = on_target_suite("runner")
        .output()
        .context("cargo does not run")?;
    let said = String::from_utf8_lossy(&output.stdout);
    for outcome in RUNNER_OUTCOMES {
        ensure!(
            said.lines().any(|line| line == outcome),
            "the test runner did not report `{outcome}`; it said:\n{said}"
        );
    }
    println!("the test runner tells passing, panicking, faulting and hanging tests apart");
    Ok(())
}

fn on_target_suite(suite: &str) -> Command {
    let mut command = for_board("test", Board::Mps2);
    // The workbench is built already, by the linter.
    command
        .args(["--test", suite])
        .env("DEFMT_LOG", "info")
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUNNER", tool::runner());
    command
}

fn documentation() -> Result<()> {
    let deny = ("RUSTDOCFLAGS", "-D warnings");
    run(cargo(&["doc", "--workspace", "--no-deps"]).env(deny.0, deny.1))?;
    run(for_board("doc", Board::Mps2)
        .args(["--no-deps", "--lib"])
        .env(deny.0, deny.1))?;
    run(cargo(&["test", "--doc", "--quiet"]).args(ON_HOST))
}

/// A cargo command on the firmware for `board`, in the firmware's profile.
fn for_board(command: &str, board: Board) -> Command {
    cargo(&[
        command,
        "--profile",
        images::PROFILE,
        "--package",
        FIRMWARE,
        "--target",
        TARGET,
        "--features",
        &board.feature(),
    ])
}
