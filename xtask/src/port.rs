//! The example of a port (`docs/porting.md`): another PCB with the driver board's chip, its pins, shunt and amplifier, as the
//! change that it takes in the firmware and in the models of the board.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::cargo::{cargo, run, target_directory, workspace};
use crate::hil;

/// The change.
const CHANGE: &str = "docs/examples/another-pcb.patch";

/// Fails where the example no longer fits the sources.
pub(crate) fn fits() -> Result<()> {
    let mut check = git(workspace(), &["apply", "--check", CHANGE]);
    run(&mut check).context("the example of docs/porting.md: change it with what it changes")
}

/// Builds the image of that PCB, in a copy of the sources, and runs it on the silicon twin of that PCB.
pub(crate) fn check() -> Result<()> {
    let (sources, builds) = (place().join("sources"), place().join("target"));
    copy_sources(&sources)?;
    let change = workspace().join(CHANGE);
    // Else it would take the copy for a part of this repository.
    let mut apply = git(&sources, &["apply"]);
    run(apply.arg(change).env("GIT_CEILING_DIRECTORIES", place()))?;
    for words in [
        &["xtask", "build", "stm32g474"][..],
        &["build", "--package", "host-tool"],
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
        let mut command = cargo(words);
        command
            .current_dir(&sources)
            .env("CARGO_TARGET_DIR", &builds);
        run(command
            .env("MIRROR_EMULATOR", "g474")
            .env_remove("MIRROR_BOARD"))?;
    }
    Ok(())
}

fn place() -> PathBuf {
    target_directory().join("another-pcb")
}

fn git(directory: &Path, words: &[&str]) -> Command {
    let mut git = Command::new("git");
    git.args(words).current_dir(directory);
    git
}

/// Copies what the repository holds, as it is now.
fn copy_sources(to: &Path) -> Result<()> {
    let listed = git(workspace(), &["ls-files", "-z"]).output();
    let listed = listed.context("git does not run")?;
    ensure!(listed.status.success(), "git cannot tell the sources");
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
    for name in String::from_utf8(listed.stdout)?.split_terminator('\0') {
        let copy = to.join(name);
        fs::create_dir_all(copy.parent().context("it lies in a folder")?)?;
        // What was deleted, and not yet committed, is not there.
        if workspace().join(name).exists() {
            fs::copy(workspace().join(name), copy).with_context(|| name.to_owned())?;
        }
    }
    Ok(())
}
