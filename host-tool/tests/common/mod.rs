//! The tool as a user types it.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// What the tool said, and how it ended.
pub(crate) struct Said {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Said {
    /// What went wrong, on one line: the tool breaks its lines to the terminal's width.
    pub(crate) fn sentence(&self) -> String {
        let words: Vec<&str> = self.err.split_whitespace().collect();
        words.join(" ").replace("│ ", "")
    }
}

/// Runs `host-tool` with the boards in `directory`, and no others.
pub(crate) fn host_tool(directory: &Path, words: &[&str]) -> Said {
    host_tool_with(directory, words, &[])
}

/// The same, in an environment with these places.
pub(crate) fn host_tool_with(directory: &Path, words: &[&str], places: &[(&str, &Path)]) -> Said {
    let output = Command::new(env!("CARGO_BIN_EXE_host-tool"))
        .args(words)
        .env("MIRROR_BOARDS", directory)
        .env_remove("MIRROR_BOARD")
        .env("NO_COLOR", "1")
        .envs(places.iter().copied())
        .output()
        .expect("the tool runs");
    Said {
        code: output.status.code().expect("it was not killed"),
        out: String::from_utf8(output.stdout).expect("text"),
        err: String::from_utf8(output.stderr).expect("text"),
    }
}

/// An empty directory of boards, private as an emulated board makes it.
pub(crate) fn no_boards() -> TempDir {
    let private = Permissions::from_mode(0o700);
    let directory = tempfile::Builder::new().permissions(private).tempdir();
    directory.expect("a directory")
}
