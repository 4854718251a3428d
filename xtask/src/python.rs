//! The Python package: installed into an environment of its own, checked by mypy, and tested on an emulated board.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::cargo::{program, run, target_directory, workspace};
use crate::tool;

/// The package's environment.
const NAME: &str = "python";
/// What tests and types are checked by, and frames are made by.
const CHECKS: [&str; 4] = ["pytest>=8", "mypy>=1.11", "pandas>=2", "pandas-stubs"];
/// The frameworks that there are drivers for, and what executes the notebook: a minute or more to install.
const FRAMEWORKS: [&str; 10] = [
    "qcodes>=0.46",
    "pymeasure>=0.15",
    "pyvisa-py>=0.7",
    "ophyd-async>=0.9",
    "bluesky>=1.13",
    "caproto>=1.2",
    "ipykernel>=6",
    "matplotlib>=3.9",
    "nbclient>=0.10",
    "nbformat>=5.10",
];

/// Installs the package and tests it; with `full` its drivers too, in their frameworks.
pub(crate) fn check(full: bool) -> Result<()> {
    tool::build()?;
    let environment = environment(NAME)?;
    let package = workspace().join("python");
    let mut install = pip()?;
    install
        .args(["install", "--quiet", "--editable"])
        .arg(&package);
    install.args(CHECKS);
    if full {
        install.args(FRAMEWORKS);
    }
    run(&mut install)
        .context("what the tests need comes from the package index; is there a network?")?;
    let mut types = Command::new(environment.join("bin/mypy"));
    run(types.current_dir(&package))?;
    let mut tests = program(environment.join("bin/pytest"));
    tests
        .args(["-rs", "--capture=tee-sys"])
        .current_dir(&package);
    tests.env("MIRROR_HOST_TOOL", tool::command().get_program());
    let emulate = tool::workbench();
    tests.env(
        "MIRROR_EMULATE",
        format!("'{}' emulate", Path::new(emulate.get_program()).display()),
    );
    tests.env("MIRROR_SOURCES", workspace());
    if full {
        tests.env(long_runs::VARIABLE, "1");
    }
    run(&mut tests)
}

/// The environment's pip.
pub(crate) fn pip() -> Result<Command> {
    Ok(Command::new(environment(NAME)?.join("bin/pip")))
}

/// An environment of this name below `target`, made where it is missing.
///
/// # Errors
/// Without Python 3.11 or its module `venv`, in words that say what to install.
pub fn environment(name: &str) -> Result<PathBuf> {
    let folder = target_directory().join(name);
    if folder.join("bin/pip").exists() {
        return Ok(folder);
    }
    let recent = "import sys; sys.exit(sys.version_info < (3, 11))";
    match Command::new("python3").args(["-c", recent]).status() {
        Err(error) => bail!("python3 does not run ({error}); install Python 3.11 or later"),
        Ok(status) if !status.success() => {
            bail!("python3 is too old; install Python 3.11 or later")
        }
        Ok(_) => {}
    }
    run(Command::new("python3").args(["-m", "venv"]).arg(&folder))
        .context("Python makes no environment; on Debian and Ubuntu: `apt install python3-venv`")?;
    Ok(folder)
}
