//! The host tool, as the tasks use it.

use std::process::Command;

use anyhow::{Context, Result};

use crate::cargo::{self, cargo, target_directory};

/// Builds the tool.
pub(crate) fn build() -> Result<()> {
    cargo::run(cargo(&["build", "--bin", "host-tool"]).args(cargo::ON_HOST))
}

/// The tool, once it is built.
pub(crate) fn command() -> Command {
    Command::new(target_directory().join("debug").join("host-tool"))
}

/// What the tool prints as JSON, or in words why it does not.
pub(crate) fn json(tool: &mut Command) -> Result<serde_json::Value> {
    let output = tool
        .arg("--json")
        .output()
        .context("the host tool does not run")?;
    serde_json::from_slice(&output.stdout)
        .with_context(|| String::from_utf8_lossy(&output.stderr).into_owned())
}
