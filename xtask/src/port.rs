//! The example of a port (`docs/porting.md`): another PCB with the driver board's chip, its pins, shunt and amplifier, as the
//! change that it takes in the firmware and in the models of the board.

use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::cargo::{run, workspace};
use crate::copy::{SourceCopy, check_fit};
use crate::hil;

fn change() -> PathBuf {
    workspace().join("docs/examples/another-pcb.patch")
}

/// Fails where the example no longer fits the sources.
pub(crate) fn fits() -> Result<()> {
    check_fit(&change()).context("the example of docs/porting.md: change it with what it changes")
}

/// Builds the image of that PCB, in a copy of the sources.
fn build() -> Result<SourceCopy> {
    let copy = SourceCopy::make("another-pcb")?;
    copy.apply(&change())?;
    copy.build_image()?;
    Ok(copy)
}

/// Builds it, and runs it on the silicon twin of that PCB.
pub(crate) fn check() -> Result<()> {
    let copy = build()?;
    for words in [
        &["build", "--package", "host-tool"][..],
        &[
            "test",
            "--package",
            hil::PACKAGE,
            "--test",
            "acceptance",
            "--test",
            "silicon",
        ],
    ] {
        let mut command = copy.cargo(words);
        run(command
            .env("MIRROR_EMULATOR", "g474")
            .env_remove("MIRROR_BOARD"))?;
    }
    Ok(())
}
