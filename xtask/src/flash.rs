//! Firmware onto a connected driver board, by probe-rs.

use std::process::Command;

use anyhow::{Result, bail};

use crate::cargo::{answers, run};
use crate::images::{self, Board};

const CHIP: &str = "STM32G474RETx";

/// Builds the driver board's image and writes it.
pub(crate) fn run_probe() -> Result<()> {
    if !answers("probe-rs", "--version") {
        bail!(
            "probe-rs is not installed, and flashing needs it: `cargo install probe-rs-tools \
             --locked`, or see https://probe.rs"
        );
    }
    let image = images::build(Board::Stm32g474)?;
    run(Command::new("probe-rs")
        .args(["download", "--verify", "--chip", CHIP])
        .arg(image))?;
    run(Command::new("probe-rs").args(["reset", "--chip", CHIP]))
}
