//! Other programs, started so that a person sees what is done.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

/// The microcontroller's target: both boards are a Cortex-M4F.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// What cargo selects for the host. All tasks select all of it, and choose by target: cargo unites the features of the
/// packages that are selected, and a smaller selection would be built once more.
pub const ON_HOST: [&str; 3] = ["--workspace", "--exclude", "mirror-firmware"];

/// The workspace's directory.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("xtask lies within the workspace")
}

/// Where cargo builds.
pub fn target_directory() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from)
}

/// Where a program is unpacked that the system does not have; `cargo clean` takes it away.
pub(crate) fn unpacked() -> PathBuf {
    target_directory().join("qemu")
}

/// Where it is started.
pub(crate) fn unpacked_programs() -> PathBuf {
    unpacked().join("bin")
}

/// A program, which finds the emulator that was unpacked for the workspace where the system has none.
pub fn program(path: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(path);
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = env::split_paths(&path).chain([unpacked_programs()]);
    if let Ok(path) = env::join_paths(folders) {
        command.env("PATH", path);
    }
    command
}

/// This toolchain's cargo, in the workspace.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = program(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(workspace());
    command
}

/// Says what is run, runs it, and fails where it fails.
pub fn run(command: &mut Command) -> Result<()> {
    eprintln!("> {}", describe(command));
    let status = command
        .status()
        .with_context(|| format!("`{}`", describe(command)))?;
    if !status.success() {
        bail!("`{}` failed ({status})", describe(command));
    }
    Ok(())
}

/// Whether a program answers.
pub fn answers(program: &str, argument: &str) -> bool {
    Command::new(program)
        .arg(argument)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// The command as a person would type it.
pub fn describe(command: &Command) -> String {
    let program = Path::new(command.get_program())
        .file_name()
        .unwrap_or_default();
    std::iter::once(program)
        .chain(command.get_args())
        .map(|word| word.to_string_lossy())
        .collect::<Vec<_>>()
        .join(" ")
}
