//! Firmware onto a connected driver board, and its log, by probe-rs.

use std::process::Command;

use anyhow::{Result, bail};

use crate::cargo::{answers, run};
use crate::images::{self, Board};

const CHIP: &str = "STM32G474RETx";

/// Builds the driver board's image and writes it; with `log`, stays and prints what the firmware says.
pub(crate) fn run_probe(log: bool) -> Result<()> {
    if !answers("probe-rs", "--version") {
        bail!(
            "probe-rs is not installed, and flashing needs it: `cargo install probe-rs-tools \
             --locked`, or see https://probe.rs"
        );
    }
    let image = images::build(Board::Stm32g474)?;
    if log {
        // It finds the log's table in the image, and its buffer in the board's RAM. A fault is the firmware's to handle:
        // it turns the outputs off, which a processor that is halted at its handler would not.
        return run(Command::new("probe-rs")
            .args(["run", "--verify", "--chip", CHIP])
            .args(["--no-catch-hardfault", "--no-catch-reset"])
            .arg(image));
    }
    run(Command::new("probe-rs")
        .args(["download", "--verify", "--chip", CHIP])
        .arg(image))?;
    run(Command::new("probe-rs").args(["reset", "--chip", CHIP]))
}
