//! The Python package as a wheel, with the programs in it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::release::source_date;
use crate::cargo::{run, workspace};
use crate::python;

/// Builds it from `python/` and the tree; its build hook puts the two together.
pub(super) fn build(tree: &Path, folder: &Path) -> Result<PathBuf> {
    let mut pip = python::pip()?;
    run(pip
        .args(["wheel", "--quiet", "--no-deps", "--wheel-dir"])
        .arg(folder)
        .arg(workspace().join("python"))
        .env("MIRROR_TREE", tree)
        .env("SOURCE_DATE_EPOCH", source_date()?))
    .context("what builds wheels comes from the package index; is there a network?")?;
    let mut entries = std::fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path()));
    entries
        .find(|path| path.extension().is_some_and(|end| end == "whl"))
        .context("no wheel was built")
}
