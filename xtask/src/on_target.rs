//! What runs on the target in the emulator: the emulated board's image, and suites of tests, built and linted together.

use std::process::{Command, Output};

use anyhow::{Result, ensure};

use crate::cargo::{TARGET, cargo};
use crate::checks::Check;
use crate::images::{self, Board};
use crate::test_programs::{self, LINTER, TestProgram};
use crate::tool;

const FIRMWARE: &str = "mirror-firmware";

/// A suite of tests that fail on purpose, for the test runner.
const RUNNER: &str = "tests/runner";

/// What the test runner must make of it.
const RUNNER_OUTCOMES: [&str; 6] = [
    "test faults ... FAILED",
    "test hangs ... FAILED (it hangs)",
    "test panics ... FAILED",
    "test panics_as_it_should ... ok",
    "test passes ... ok",
    "test result: FAILED. 2 passed; 3 failed",
];

/// Builds the emulated board's image and everything that runs beside it, by the linter. What is flashed is built by the
/// compiler itself, for its bytes must be those of `cargo xtask flash`; its library is linted apart, in the profile in which all
/// that it depends on is built already.
pub(crate) fn build_and_lint() -> Result<Vec<TestProgram>> {
    let mut build = for_board("build", Board::Mps2);
    build.arg("--all-targets").env(LINTER.0, LINTER.1);
    let suites = test_programs::programs(&mut build)?;
    let mut driver_board = for_board("build", Board::Stm32g474);
    test_programs::without_complaint(driver_board.arg("--lib").env(LINTER.0, LINTER.1))?;
    Ok(suites)
}

/// A suite, run in the emulator test by test.
pub(crate) fn check(suite: &TestProgram) -> Check {
    let mut command = tool::workbench();
    command.arg("run-on-target").arg(suite.path());
    let mut check = Check::new(format!("{} on the target", suite.name), command);
    if suite.name == RUNNER {
        check.verdict = tells_outcomes_apart;
        check.fails_on_purpose = true;
    }
    check
}

fn tells_outcomes_apart(output: &Output) -> Result<()> {
    let said = String::from_utf8_lossy(&output.stdout);
    for outcome in RUNNER_OUTCOMES {
        ensure!(
            said.lines().any(|line| line == outcome),
            "the test runner did not report `{outcome}`"
        );
    }
    Ok(())
}

/// The documentation of the firmware.
pub(crate) fn document() -> Command {
    let mut command = for_board("doc", Board::Mps2);
    command.args(["--no-deps", "--lib"]);
    command
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
