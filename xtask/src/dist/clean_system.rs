//! Each package installed where nothing of the project is, and a mirror moved there.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use super::release::{CHECKSUMS, NAME, PROGRAMS, Released, VERSION, copy};
use crate::cargo::{cargo, program, run, target_directory, workspace};
use crate::python;
use crate::setup;

/// What is typed on the clean system.
const SCRIPT: &str = "packaging/try-packages.sh";
/// Makes a Debian of its own out of a mirror's packages.
const DEBIAN: &str = "mmdebstrap";

/// Wheel and Debian package in a fresh Debian, the sources with this machine's Rust in folders of their own.
pub(super) fn try_all(released: &Released) -> Result<()> {
    run(Command::new("sha256sum")
        .args(["--check", "--quiet", CHECKSUMS])
        .current_dir(&released.folder))?;
    in_a_fresh_debian(released)?;
    by_cargo_install(released)
}

/// Installs Debian package and wheel in a Debian in which nothing else is, as its script says.
fn in_a_fresh_debian(released: &Released) -> Result<()> {
    setup::programs(&[DEBIAN])?;
    let bench = target_directory().join("dist/bench");
    if bench.exists() {
        fs::remove_dir_all(&bench)?;
    }
    fs::create_dir_all(&bench)?;
    for file in [&released.wheel, &released.debian, &workspace().join(SCRIPT)] {
        let name = file.file_name().context("it has a name")?;
        copy(file, &bench.join(name))?;
    }
    // The clean system has no certificates; what the wheel needs besides is fetched here.
    run(python::pip()?
        .args(["download", "--quiet", "--dest"])
        .arg(&bench)
        .arg(&released.wheel))?;
    let release = fs::read_to_string("/etc/os-release")?;
    let mut words = release.lines().filter_map(|line| line.split_once('='));
    let suite = words.find(|(key, _)| *key == "VERSION_CODENAME");
    let (_, suite) =
        suite.context("this system does not name its release, which the clean one is to have")?;
    run(Command::new(DEBIAN)
        .args(["--variant=apt", "--format=null"])
        .arg(format!("--customize-hook=copy-in '{}' /", bench.display()))
        .arg("--customize-hook=chroot \"$1\" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin sh /bench/try-packages.sh")
        .args([suite, "-"]))
}

/// Installs the tool from the archive of the sources. The Rust toolchain is this machine's, and so is what is downloaded
/// already; the emulated board beside it is that of the packages.
fn by_cargo_install(released: &Released) -> Result<()> {
    let place = target_directory().join("dist/cargo");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    let (sources, installed) = (place.join("sources"), place.join("installed"));
    fs::create_dir_all(&sources)?;
    run(Command::new("tar")
        .arg("--extract")
        .arg("--file")
        .arg(&released.sources)
        .current_dir(&sources))?;
    let [tool, emulator] = PROGRAMS;
    run(cargo(&["install", "--locked", "--path", tool, "--root"])
        .arg(&installed)
        .current_dir(sources.join(format!("{NAME}-{VERSION}")))
        .env("CARGO_TARGET_DIR", target_directory()))?;
    run(Command::new("cp")
        .arg("-a")
        .arg(released.tree.join("lib"))
        .arg(&installed))?;
    let emulator = Path::new("bin").join(emulator);
    copy(&released.tree.join(&emulator), &installed.join(&emulator))?;
    run(program(installed.join(emulator)).args(["--", "set-z", "120um"]))
}
