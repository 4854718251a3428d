//! The programs that cargo makes of the tests on the host: built at once, run one after the other.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::cargo::{self, ON_HOST, cargo};

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
    /// A command that runs it, in its package's directory and with its output, on no board but what it starts itself.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command
            .arg("--show-output")
            .current_dir(&self.directory)
            .env("CARGO_MANIFEST_DIR", &self.directory)
            .env_remove("MIRROR_BOARD");
        command
    }
}

/// Builds the tests of the workspace on the host that `targets`, words of cargo's, select, or all.
pub(crate) fn build(targets: &[String]) -> Result<Vec<TestProgram>> {
    let mut command = cargo(&["test", "--no-run"]);
    command
        .args(ON_HOST)
        .args(targets)
        .args(["--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit());
    eprintln!("> {}", cargo::describe(&command));
    let output = command.output().context("cargo does not run")?;
    ensure!(output.status.success(), "the tests cannot be built");
    let programs: Vec<TestProgram> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| test_program(&serde_json::from_str(line).ok()?))
        .collect();
    ensure!(!programs.is_empty(), "cargo built no tests");
    Ok(programs)
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
}
