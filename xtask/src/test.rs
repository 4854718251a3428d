//! Everything that must pass before code is shared, in the order of what fails soonest.

use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::cargo::{TARGET, cargo, run};
use crate::hil;
use crate::images::{self, Board};
use crate::setup;

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

type Step = (&'static str, fn() -> Result<()>);

const STEPS: [Step; 7] = [
    ("format", format),
    ("lints", lints),
    ("tests on the host", on_host),
    (
        "images: their size, and no panic in the control tick",
        check_images,
    ),
    ("tests on the target", on_target),
    (
        "end-to-end tests on the emulated board",
        hil::on_emulated_boards,
    ),
    ("documentation", documentation),
];

/// Passes all tests, or stops at the first step that fails.
pub(crate) fn run_all() -> Result<()> {
    setup::rust_target()?;
    setup::rust_components()?;
    setup::qemu()?;
    let start = Instant::now();
    for (number, (name, step)) in (1..).zip(STEPS) {
        eprintln!("\n== {number}/{} {name}", STEPS.len());
        step().with_context(|| format!("step `{name}`"))?;
        eprintln!(
            "== {name}: passed, {:.0} s since start",
            start.elapsed().as_secs_f64()
        );
    }
    println!(
        "\nAll {} steps passed in {:.0} s.",
        STEPS.len(),
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

/// The fuzzer, with every check that a debug build makes.
pub(crate) fn fuzz(arguments: &[String]) -> Result<()> {
    let fuzzer = ["run", "--profile", "fuzz", "--package", "fuzz", "--"];
    run(cargo(&fuzzer).args(arguments))
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn lints() -> Result<()> {
    let deny = ["--", "-D", "warnings"];
    run(cargo(&[
        "clippy",
        "--workspace",
        "--exclude",
        FIRMWARE,
        "--all-targets",
    ])
    .args(deny))?;
    let on_host = ["clippy", "--package", FIRMWARE, "--lib", "--features"];
    run(cargo(&on_host).arg("board-host").args(deny))?;
    run(for_board("clippy", Board::Stm32g474)
        .args(["--lib", "--bins"])
        .args(deny))?;
    run(for_board("clippy", Board::Mps2)
        .args(["--all-targets"])
        .args(deny))
}

fn on_host() -> Result<()> {
    run(&mut cargo(&[
        "test",
        "--workspace",
        "--exclude",
        FIRMWARE,
        "--exclude",
        hil::PACKAGE,
    ]))
}

fn check_images() -> Result<()> {
    images::build_and_check(Board::Stm32g474)?;
    images::build_and_check(Board::Mps2)
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
    command
        .args(["--profile", images::PROFILE, "--test", suite])
        .env("DEFMT_LOG", "info");
    command
}

fn documentation() -> Result<()> {
    let deny = ("RUSTDOCFLAGS", "-D warnings");
    let documented = ["doc", "--workspace", "--exclude", FIRMWARE, "--no-deps"];
    run(cargo(&documented).env(deny.0, deny.1))?;
    run(for_board("doc", Board::Mps2)
        .args(["--no-deps", "--lib"])
        .env(deny.0, deny.1))
}

/// A cargo command on the firmware for `board`.
fn for_board(command: &str, board: Board) -> Command {
    cargo(&[
        command,
        "--package",
        FIRMWARE,
        "--target",
        TARGET,
        "--features",
        &board.feature(),
    ])
}
