//! The host tool and what the tasks use beside it, built together.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::cargo::{self, cargo, target_directory};

/// Programs that the tasks start.
const PROGRAMS: [&str; 3] = ["host-tool", "workbench", "missing-physics-bench"];

/// Builds them.
pub fn build() -> Result<()> {
    let words = PROGRAMS.iter().flat_map(|name| ["--bin", name]);
    cargo::run(cargo(&["build"]).args(words).args(cargo::ON_HOST))
}

/// The tool, once it is built.
pub fn command() -> Command {
    program("host-tool")
}

/// The tool as people have it, built by this.
pub fn released() -> Result<Command> {
    cargo::run(&mut cargo(&[
        "build",
        "--release",
        "--package",
        "host-tool",
    ]))?;
    let built = target_directory().join("release").join("host-tool");
    Ok(cargo::program(built))
}

/// The workbench, once it is built.
pub fn workbench() -> Command {
    program("workbench")
}

/// The bench of hidden effects, once it is built.
pub fn missing_physics() -> Command {
    program("missing-physics-bench")
}

fn program(name: &str) -> Command {
    cargo::program(path(name))
}

fn path(name: &str) -> PathBuf {
    target_directory().join("debug").join(name)
}

/// What the tool prints as JSON, or in words why it does not.
pub fn json(tool: &mut Command) -> Result<Value> {
    let output = tool
        .arg("--json")
        .output()
        .context("the host tool does not run")?;
    serde_json::from_slice(&output.stdout)
        .with_context(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Has the workbench write what `host-tool update` takes beside an ELF file.
pub(crate) fn package(elf: &Path) -> Result<()> {
    cargo::run(workbench().args(["package", "--force"]).arg(elf))
}

/// Has the workbench write the tool's manual pages.
pub(crate) fn write_manual(folder: &Path) -> Result<()> {
    cargo::run(workbench().arg("man").arg(folder))
}
