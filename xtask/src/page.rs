//! The lab's own code for the report page, as WebAssembly.

use std::env;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::cargo::{cargo, run, target_directory, workspace};
use crate::setup;

const TARGET: &str = "wasm32-unknown-unknown";
const PROFILE: &str = "page";
/// Where the tool has it from. It lies there as built, so that building the tool takes no other target than the host's.
const BUILT: &str = "host-tool/src/page/lab-view.wasm";

/// Builds it and puts it where the tool has it from.
pub(crate) fn build() -> Result<()> {
    setup::rust_target(TARGET)?;
    // Panics name the files that they are in: by names that are the same on every machine.
    let home = env::var_os("HOME").map(PathBuf::from).unwrap_or_default();
    let registry = env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let remapped = [(registry, "/cargo"), (workspace().to_owned(), "")]
        .map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display()));
    let mut build = cargo(&["build", "--package", "lab-view-wasm", "--profile", PROFILE]);
    build.args(["--target", TARGET]);
    build.env("CARGO_ENCODED_RUSTFLAGS", remapped.join("\x1f"));
    run(&mut build)?;
    let built = target_directory()
        .join(TARGET)
        .join(PROFILE)
        .join("lab_view_wasm.wasm");
    fs::copy(&built, workspace().join(BUILT)).with_context(|| built.display().to_string())?;
    println!("written: {BUILT}");
    Ok(())
}
