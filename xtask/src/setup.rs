//! What the tasks need beyond a Rust toolchain, installed where it is missing.

use std::process::Command;

use anyhow::{Context, Result, bail};
use emulated_board::QEMU;

use crate::cargo::{self, TARGET};

/// Makes sure that the microcontroller's target is installed.
pub(crate) fn rust_target() -> Result<()> {
    let sysroot = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .output()
        .context("rustc does not run; install Rust from https://rustup.rs")?;
    let directory = String::from_utf8_lossy(&sysroot.stdout).trim().to_owned();
    if std::path::Path::new(&directory).is_dir() {
        return Ok(());
    }
    eprintln!("The Rust target of the microcontroller ({TARGET}) is missing; installing it.");
    cargo::run(Command::new("rustup").args(["target", "add", TARGET]))
        .with_context(|| format!("install the target yourself: rustup target add {TARGET}"))
}

/// Makes sure that the formatter and the linter are installed.
pub(crate) fn rust_components() -> Result<()> {
    for (tool, component) in [("cargo-fmt", "rustfmt"), ("cargo-clippy", "clippy")] {
        if !cargo::answers(tool, "--version") {
            eprintln!("{component} is missing; installing it.");
            cargo::run(Command::new("rustup").args(["component", "add", component]))?;
        }
    }
    Ok(())
}

/// Makes sure that the emulator is installed, by the system's package manager.
pub(crate) fn qemu() -> Result<()> {
    if cargo::answers(QEMU, "--version") {
        return Ok(());
    }
    eprintln!("The emulator ({QEMU}) is missing; installing it from the system's packages.");
    let by_hand = "install QEMU for Arm yourself: Debian and Ubuntu `apt-get install \
                   qemu-system-arm`, Fedora `dnf install qemu-system-arm`, Arch `pacman -S \
                   qemu-system-arm`";
    if cargo::answers("apt-get", "--version") {
        run_as_root(&["apt-get", "update", "-qq"]).context(by_hand)?;
        run_as_root(&[
            "apt-get",
            "install",
            "-qq",
            "-y",
            "--no-install-recommends",
            QEMU,
        ])
        .context(by_hand)?;
    } else if cargo::answers("dnf", "--version") {
        run_as_root(&["dnf", "install", "-y", QEMU]).context(by_hand)?;
    } else if cargo::answers("pacman", "--version") {
        run_as_root(&["pacman", "-S", "--noconfirm", QEMU]).context(by_hand)?;
    }
    if !cargo::answers(QEMU, "--version") {
        bail!("{QEMU} is still not there; {by_hand}");
    }
    Ok(())
}

fn run_as_root(words: &[&str]) -> Result<()> {
    let is_root = Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|id| id.stdout == b"0\n");
    let words: Vec<&str> = if is_root {
        words.to_vec()
    } else {
        [&["sudo"], words].concat()
    };
    cargo::run(
        Command::new(words[0])
            .args(&words[1..])
            .env("DEBIAN_FRONTEND", "noninteractive"),
    )
}
