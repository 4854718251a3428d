//! What goes into packages: firmware as `host-tool update` takes it, and the tool's manual.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use clap::CommandFactory;
use host_tool::cli::Arguments;
use host_tool::update::image::Image;
use host_tool::update::package::{BOARD, Package};
use xtask::cargo::workspace;

/// Writes what `host-tool update` takes beside an ELF file.
pub(crate) fn write(elf: &Path) -> Result<()> {
    let commit = Command::new("git")
        .args(["rev-parse", "--short", "HEAD"])
        .current_dir(workspace())
        .output();
    let commit = commit.map_or(String::new(), |output| {
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    });
    let package = Package {
        board: BOARD.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        build: commit,
        image: Image::from_elf(&fs::read(elf)?)?,
    };
    let path = elf.with_extension("update");
    fs::write(&path, package.to_bytes()).with_context(|| format!("writing {}", path.display()))
}

/// Writes a manual page of the tool, and one of each command.
pub(crate) fn write_manual(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    clap_mangen::generate_to(Arguments::command(), folder)?;
    Ok(())
}
