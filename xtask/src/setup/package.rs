//! A package of the system's, installed so that it costs no other package.

use std::process::Command;

use anyhow::{Context, Result};

use super::apt::{self, Simulation};
use crate::cargo::{answers, run};

/// Installs a package that Debian, Fedora and Arch call by the same name. Returns why it was not done where apt would remove or
/// downgrade another; where there is no package manager that is known, nothing is done.
pub(super) fn install(package: &str) -> Result<Option<String>> {
    if answers("apt-get", "--version") {
        return install_by_apt(package);
    }
    if answers("dnf", "--version") {
        // It removes nothing unless it is told `--allowerasing`.
        run(&mut as_root(&["dnf", "install", "-y", package]))?;
    } else if answers("pacman", "--version") {
        // With `--noconfirm`, what conflicts is an error and stays.
        run(&mut as_root(&["pacman", "-S", "--noconfirm", package]))?;
    }
    Ok(None)
}

/// Installs the first version that costs no other package.
fn install_by_apt(package: &str) -> Result<Option<String>> {
    // Without a network, what apt knows already may do.
    if let Err(error) = run(&mut as_root(&["apt-get", "update", "-qq"])) {
        eprintln!("The list of packages stays as it is: {error:#}");
    }
    let madison = apt_command("apt-cache", &["madison", package]).output()?;
    let candidates = apt::candidates(&said_in(&madison.stdout));
    let refused = match apt::choose(candidates, |version| simulate(package, version))? {
        Ok(version) => match install_version(package, &version) {
            Ok(()) => return Ok(None),
            Err(error) => format!("{error:#}"),
        },
        Err(reasons) => reasons.join("\n  "),
    };
    Ok(Some(refused))
}

fn install_version(package: &str, version: &apt::From) -> Result<()> {
    eprintln!("Taking {version}: it removes and downgrades nothing.");
    let mut install = as_root(&["apt-get", "install", "-qq", "-y", "--no-remove"]);
    install.arg("--no-install-recommends").args(version.words());
    run(install.arg(package))
}

fn simulate(package: &str, version: &apt::From) -> Result<Simulation> {
    let output = simulation(package, &version.words())
        .output()
        .context("apt-get does not run")?;
    let said = said_in(&output.stdout) + &said_in(&output.stderr);
    Ok(Simulation::read(output.status.success(), &said))
}

/// Has apt say what an installation would do.
pub(super) fn simulation(package: &str, words: &[&str]) -> Command {
    let mut command = apt_command("apt-get", &["--simulate", "install"]);
    command
        .arg("--no-install-recommends")
        .args(words)
        .arg(package);
    command
}

/// apt's programs in the language that [`apt`] reads.
pub(super) fn apt_command(program: &str, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(words).env("LC_ALL", "C");
    command
}

pub(super) fn said_in(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn as_root(words: &[&str]) -> Command {
    let is_root = Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|id| id.stdout == b"0\n");
    let mut command = match is_root {
        true => Command::new("env"),
        false => Command::new("sudo"),
    };
    command.args(["DEBIAN_FRONTEND=noninteractive"]).args(words);
    command
}
