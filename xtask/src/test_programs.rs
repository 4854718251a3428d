//! The programs that cargo makes of the tests on the host: built at once, and run by the gate.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::cargo::{self, ON_HOST, cargo};

/// What makes cargo build the workspace's packages by the linter, which is the compiler and says more.
pub(crate) const LINTER: (&str, &str) = ("RUSTC_WORKSPACE_WRAPPER", "clippy-driver");

/// A program of tests.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct TestProgram {
    /// The package that it tests.
    pub(crate) package: String,
    /// `tests/NAME`, or the library or program with its unit tests.
    pub(crate) name: String,
    /// The package's directory, in which its tests run.
    directory: PathBuf,
    path: PathBuf,
}

impl TestProgram {
    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// A command that runs it, in its package's directory and with its output, on no board but what it starts itself.
    pub(crate) fn command(&self) -> Command {
        let mut command = cargo::program(&self.path);
        command
            .arg("--show-output")
            .current_dir(&self.directory)
            .env("CARGO_MANIFEST_DIR", &self.directory)
            .env_remove("MIRROR_BOARD");
        command
    }
}

/// Builds the tests of the workspace on the host that `targets`, words of cargo's, select.
pub(crate) fn build(targets: &[String]) -> Result<Vec<TestProgram>> {
    programs(cargo(&["test", "--no-run"]).args(ON_HOST).args(targets))
}

/// Builds everything on the host, by the linter. What it says is an error.
pub(crate) fn build_and_lint() -> Result<Vec<TestProgram>> {
    programs(
        // Which crate takes how long is in `target/cargo-timings`.
        cargo(&["build", "--all-targets", "--timings"])
            .args(ON_HOST)
            .env(LINTER.0, LINTER.1)
            // Built once and never changed: what the next build and a debugger would need costs a third of the time, and so does
            // what more processors than two would gain by.
            .envs([
                ("CARGO_INCREMENTAL", "0"),
                ("CARGO_PROFILE_DEV_DEBUG", "0"),
                ("CARGO_PROFILE_DEV_CODEGEN_UNITS", "2"),
            ]),
    )
}

/// The programs of tests that a command of cargo's builds, which must not make the compiler say anything.
pub(crate) fn programs(command: &mut Command) -> Result<Vec<TestProgram>> {
    let messages = without_complaint(command)?;
    let programs: Vec<TestProgram> = messages.iter().filter_map(test_program).collect();
    ensure!(!programs.is_empty(), "cargo built no tests");
    Ok(programs)
}

/// What a command of cargo's tells of what it builds, where the compiler has nothing to say about it.
pub(crate) fn without_complaint(command: &mut Command) -> Result<Vec<Value>> {
    eprintln!("> {}", cargo::describe(command));
    let output = command
        .args(["--message-format", "json"])
        .stderr(Stdio::inherit())
        .output()
        .context("cargo does not run")?;
    let said = String::from_utf8_lossy(&output.stdout);
    let messages: Vec<Value> = said
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    let complaints: Vec<&str> = messages.iter().filter_map(complaint).collect();
    complaints
        .iter()
        .for_each(|complaint| eprint!("{complaint}"));
    ensure!(
        output.status.success() && complaints.is_empty(),
        "it cannot be built, or not without a warning"
    );
    Ok(messages)
}

/// What the compiler says, as people read it.
fn complaint(message: &Value) -> Option<&str> {
    if message["reason"] != "compiler-message" {
        return None;
    }
    message["message"]["rendered"].as_str()
}

/// The program of tests that a message of cargo's tells of.
fn test_program(message: &Value) -> Option<TestProgram> {
    if message["profile"]["test"] != true {
        return None;
    }
    let path = message["executable"].as_str()?;
    let directory = PathBuf::from(message["manifest_path"].as_str()?)
        .parent()?
        .to_owned();
    let name = message["target"]["name"].as_str()?;
    let kind = message["target"]["kind"][0].as_str()?;
    let package = directory.file_name()?.to_string_lossy().into_owned();
    Some(TestProgram {
        package,
        name: match kind {
            "test" => format!("tests/{name}"),
            kind => format!("{kind} {name}"),
        },
        directory,
        path: path.into(),
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn message(is_test: bool) -> Value {
        json!({
            "reason": "compiler-artifact",
            "manifest_path": "/there/hil/Cargo.toml",
            "target": { "kind": ["test"], "name": "faults" },
            "profile": { "test": is_test },
            "executable": "/there/target/debug/deps/faults-0123",
        })
    }

    #[test]
    fn programs_of_tests_are_found_among_what_cargo_built() {
        let program = test_program(&message(true)).expect("it is one");
        assert_eq!(
            (program.package.as_str(), program.name.as_str()),
            ("hil", "tests/faults")
        );
        assert_eq!(program.directory, PathBuf::from("/there/hil"));
        assert_eq!(test_program(&message(false)), None);
    }

    #[test]
    fn what_the_compiler_says_is_found() {
        let said = json!({
            "reason": "compiler-message",
            "message": { "level": "warning", "rendered": "warning: this loop never loops" },
        });
        assert_eq!(complaint(&said), Some("warning: this loop never loops"));
        assert_eq!(complaint(&message(true)), None);
    }
}
