//! What the tasks need beyond a Rust toolchain, installed where it is missing.

mod apt;
mod browser;
mod package;
mod programs;
mod qemu;
mod unpack;

use std::process::Command;

use anyhow::{Context, Result};

use crate::cargo;

pub(crate) use browser::{BROWSER, browser};
pub(crate) use programs::{SHELLS, programs};
pub use qemu::qemu;

/// Makes sure that a target is installed.
pub fn rust_target(target: &str) -> Result<()> {
    let sysroot = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", target])
        .output()
        .context("rustc does not run; install Rust from https://rustup.rs")?;
    let directory = String::from_utf8_lossy(&sysroot.stdout).trim().to_owned();
    if std::path::Path::new(&directory).is_dir() {
        return Ok(());
    }
    eprintln!("The Rust target {target} is missing; installing it.");
    cargo::run(Command::new("rustup").args(["target", "add", target]))
        .with_context(|| format!("install the target yourself: rustup target add {target}"))
}

/// Makes sure that the formatter and the linter are installed.
pub fn rust_components() -> Result<()> {
    for (tool, component) in [("cargo-fmt", "rustfmt"), ("cargo-clippy", "clippy")] {
        if !cargo::answers(tool, "--version") {
            eprintln!("{component} is missing; installing it.");
            cargo::run(Command::new("rustup").args(["component", "add", component]))?;
        }
    }
    Ok(())
}
