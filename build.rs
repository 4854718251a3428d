//! The linker's map of the chosen board, and what the firmware was built from.

use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

fn main() -> Result<(), Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;

    for (feature, board) in [("BOARD_MPS2", "mps2"), ("BOARD_STM32G474", "stm32g474")] {
        if env::var_os(format!("CARGO_FEATURE_{feature}")).is_some() {
            let map = format!("src/board/{board}/memory.x");
            println!("cargo::rerun-if-changed={map}");
            fs::copy(map, Path::new(&out).join("board-memory.x"))?;
        }
    }
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rustc-link-search={out}");
    if env::var("TARGET")?.starts_with("thumb") {
        for argument in ["--nmagic", "--emit-relocs", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg={argument}");
        }
        println!("cargo::rustc-link-arg-tests=-Tembedded-test.x");
    }

    // The log of HEAD changes with every commit.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit = git(&["rev-parse", "--short", "HEAD"]).unwrap_or("unknown".to_owned());
    println!("cargo::rustc-env=FIRMWARE_BUILD={commit}");
    Ok(())
}

/// What git answers, where there is git.
fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let answer = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !answer.is_empty()).then_some(answer)
}
