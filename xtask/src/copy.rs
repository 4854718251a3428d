//! A copy of the sources, to be changed and built beside them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::cargo::{TARGET, cargo, run, target_directory, workspace};
use crate::images::{self, Board, PROFILE};

/// What the repository holds, as it is now, in a folder of its own below the build's.
pub(crate) struct SourceCopy {
    place: PathBuf,
}

impl SourceCopy {
    /// Makes it, in place of an earlier one of that name.
    pub(crate) fn make(name: &str) -> Result<Self> {
        let copy = Self {
            place: target_directory().join(name),
        };
        let sources = copy.sources();
        if sources.exists() {
            fs::remove_dir_all(&sources)?;
        }
        let listed = git(
            workspace(),
            &[
                "ls-files",
                "-z",
                "--cached",
                "--others",
                "--exclude-standard",
            ],
        )
        .output();
        let listed = listed.context("git does not run")?;
        ensure!(listed.status.success(), "git cannot tell the sources");
        for name in String::from_utf8(listed.stdout)?.split_terminator('\0') {
            let (from, to) = (workspace().join(name), sources.join(name));
            // What was deleted, and not yet committed, is not there.
            if from.exists() {
                fs::create_dir_all(to.parent().context("it lies in a folder")?)?;
                fs::copy(from, to).with_context(|| name.to_owned())?;
            }
        }
        Ok(copy)
    }

    /// Changes it by a patch.
    pub(crate) fn apply(&self, patch: &Path) -> Result<()> {
        run(self.git(&["apply"]).arg(patch))
    }

    /// Takes a patch back.
    pub(crate) fn revert(&self, patch: &Path) -> Result<()> {
        run(self.git(&["apply", "--reverse"]).arg(patch))
    }

    /// Builds the driver board's image, and returns its path. What else it is made of is taken from the workspace's own build.
    pub(crate) fn build_image(&self) -> Result<PathBuf> {
        if !self.builds().exists() {
            // What cargo built for the target, and the macros that it built for that.
            for part in [Path::new(TARGET).join(PROFILE), PROFILE.into()] {
                let to = self.builds().join(&part);
                fs::create_dir_all(to.parent().context("it lies in a folder")?)?;
                let from = target_directory().join(part);
                run(Command::new("cp").arg("-a").arg(from).arg(to))?;
            }
        }
        run(self.cargo(&["build"]).args(images::words(Board::Stm32g474)))?;
        Ok(self.builds().join(images::place(Board::Stm32g474)))
    }

    /// This toolchain's cargo, in the copy and with a folder of its own to build in.
    pub(crate) fn cargo(&self, arguments: &[&str]) -> Command {
        let mut command = cargo(arguments);
        command
            .current_dir(self.sources())
            .env("CARGO_TARGET_DIR", self.builds());
        command
    }

    /// Where it builds.
    pub(crate) fn builds(&self) -> PathBuf {
        self.place.join("target")
    }

    fn sources(&self) -> PathBuf {
        self.place.join("sources")
    }

    /// Git would take the copy for a part of this repository else.
    fn git(&self, words: &[&str]) -> Command {
        let mut git = git(&self.sources(), words);
        git.env("GIT_CEILING_DIRECTORIES", &self.place);
        git
    }
}

/// Fails where a patch does not fit the sources.
pub(crate) fn check_fit(patch: &Path) -> Result<()> {
    run(git(workspace(), &["apply", "--check"]).arg(patch))
}

fn git(directory: &Path, words: &[&str]) -> Command {
    let mut git = Command::new("git");
    git.args(words).current_dir(directory);
    git
}
