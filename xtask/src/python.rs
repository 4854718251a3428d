//! The Python package: installed into an environment of its own, checked by mypy, and tested on emulated boards, its drivers in
//! their frameworks.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::cargo::{program, run, target_directory, workspace};
use crate::checks::{self, Check};
use crate::tool;

/// The package's environment.
const NAME: &str = "python";
/// What its tests need besides: what tests and types are checked by, frames are made by, and the notebook is executed by, and the
/// frameworks that there are drivers for.
const FOR_TESTS: [&str; 14] = [
    "pytest>=8",
    "mypy>=1.11",
    "pandas>=2",
    "pandas-stubs",
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
/// Its tests, in parts that may run beside each other, the longest first.
const PARTS: [(&str, &[&str]); 3] = [
    ("the notebook", &["tests/test_notebook.py"]),
    ("four boards", &["tests/test_many_boards.py"]),
    (
        "the Python package and its drivers",
        &[
            "tests/test_drivers.py",
            "tests/test_instrument.py",
            "tests/test_lab.py",
            "tests/test_mirror.py",
            "tests/test_pages.py",
        ],
    ),
];

/// Installs the package, and what its tests need: some 20 s of a processor, mostly unpacking. Python compiles what the tests
/// import, and not all that there is, which takes 30 s more.
pub(crate) fn install() -> Result<()> {
    let mut install = pip()?;
    install
        .args(["install", "--quiet", "--no-compile", "--editable"])
        .arg(package());
    run(install.args(FOR_TESTS))
        .context("what the tests need comes from the package index; is there a network?")
}

/// Types and tests of the package that was installed, with the tools that are built; what is long only where all is tested.
pub(crate) fn checks(is_full: bool) -> Result<Vec<Check>> {
    let bin = environment(NAME)?.join("bin");
    let check = |name: &str, program: &str| {
        let mut command = program_in_package(bin.join(program));
        command
            .env("MIRROR_HOST_TOOL", tool::command().get_program())
            .env("MIRROR_EMULATE", emulate())
            .env("MIRROR_SOURCES", workspace());
        if is_full {
            command.env(long_runs::VARIABLE, "1");
        }
        Check::new(name.to_owned(), command)
    };
    let tests = PARTS.into_iter().map(|(name, files)| {
        let mut check = check(name, "pytest");
        check.command.args(["-rs", "--capture=tee-sys"]).args(files);
        check
    });
    let types = check("types of the Python package", "mypy");
    Ok(tests.chain([types]).collect())
}

/// Installs the package and tests it.
pub(crate) fn check(is_full: bool) -> Result<()> {
    tool::build()?;
    install()?;
    checks::run(checks(is_full)?).map(drop)
}

fn package() -> PathBuf {
    workspace().join("python")
}

fn program_in_package(path: PathBuf) -> Command {
    let mut command = program(path);
    command.current_dir(package());
    command
}

/// The command that starts an emulated board.
fn emulate() -> String {
    let workbench = tool::workbench();
    format!("'{}' emulate", Path::new(workbench.get_program()).display())
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
