//! What is released: how it is called, where it lies, and what all packages are made with.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::cargo::{describe, workspace};

/// What everything is called that is released.
pub(super) const NAME: &str = "electrothermal-mirror";
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The programs in it. Each is built by itself, as `cargo install` does.
pub(super) const PROGRAMS: [&str; 2] = ["host-tool", "mirror-emulator"];
/// What is inside, and under which licences.
pub(super) const LICENCES: &str = "licences.txt";
pub(super) const CHECKSUMS: &str = "SHA256SUMS";

/// What was built, in a folder for people.
pub(super) struct Released {
    pub(super) folder: PathBuf,
    /// The tree that wheel and Debian package are made of.
    pub(super) tree: PathBuf,
    pub(super) sources: PathBuf,
    pub(super) wheel: PathBuf,
    pub(super) debian: PathBuf,
}

/// Copies a file into a folder that is made where it is missing.
pub(super) fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to.parent().context("it lies in a folder")?)?;
    fs::copy(from, to).with_context(|| format!("copying {}", from.display()))?;
    Ok(())
}

/// The time that packages carry: of the commit, so that the same sources make the same packages
/// (<https://reproducible-builds.org/specs/source-date-epoch/>).
pub(super) fn source_date() -> Result<String> {
    said_by(
        Command::new("git")
            .args(["log", "-1", "--format=%ct"])
            .current_dir(workspace()),
    )
}

/// What a program prints, without the end of its line.
pub(super) fn said_by(command: &mut Command) -> Result<String> {
    let words = describe(command);
    let output = command.output().with_context(|| format!("`{words}`"))?;
    ensure!(
        output.status.success(),
        "`{words}`: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(String::from_utf8(output.stdout)?.trim_end().to_owned())
}
