//! The workspace's packages and what they are built from, as cargo tells it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::cargo::{TARGET, cargo, workspace};

/// What is released runs on these: the tool, and the firmware.
pub(crate) const PLATFORMS: [&str; 2] = ["x86_64-unknown-linux-gnu", TARGET];

/// A package of this workspace or of a registry.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) version: String,
    /// An SPDX expression, or what the package says in its place.
    pub(crate) licence: Option<String>,
    /// The registry or repository that it comes from; none for packages of this workspace.
    pub(crate) source: Option<String>,
    /// SHA-256 of the archive that the registry serves.
    pub(crate) checksum: Option<String>,
    /// Where its sources lie.
    pub(crate) folder: PathBuf,
}

/// The packages that `selection`, words of `cargo tree`, is built from. Unlike `cargo metadata`, the tree leaves out what no
/// feature switches on.
pub(crate) fn built(selection: &[&str]) -> Result<BTreeSet<Package>> {
    let checksums = checksums()?;
    let metadata = metadata()?;
    let output = cargo(&["tree", "--locked", "--quiet", "--prefix", "none"])
        .args(["--format", "{p}"])
        .args(selection)
        .output()
        .context("cargo does not run")?;
    ensure!(
        output.status.success(),
        "cargo tree: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let said = String::from_utf8_lossy(&output.stdout);
    let in_tree: BTreeSet<(&str, &str)> = said.lines().filter_map(name_and_version).collect();
    Ok(list(&metadata["packages"])
        .iter()
        .map(|package| Package {
            name: text(&package["name"]).to_owned(),
            version: text(&package["version"]).to_owned(),
            licence: package["license"].as_str().map(str::to_owned),
            source: package["source"].as_str().map(str::to_owned),
            checksum: None,
            folder: Path::new(text(&package["manifest_path"])).with_file_name(""),
        })
        .filter(|package| in_tree.contains(&(package.name.as_str(), package.version.as_str())))
        .map(|package| Package {
            checksum: checksums
                .get(&(package.name.clone(), package.version.clone()))
                .cloned(),
            ..package
        })
        .collect())
}

/// `name v1.2.3 (proc-macro)`, as cargo's tree names a package.
fn name_and_version(line: &str) -> Option<(&str, &str)> {
    let mut words = line.split_whitespace();
    Some((words.next()?, words.next()?.strip_prefix('v')?))
}

/// The checksums in `Cargo.lock`, by name and version.
fn checksums() -> Result<BTreeMap<(String, String), String>> {
    let lock: toml::Table =
        toml::from_str(&std::fs::read_to_string(workspace().join("Cargo.lock"))?)?;
    let packages = lock["package"].as_array().context("Cargo.lock is empty")?;
    let word = |package: &toml::Value, key: &str| Some(package.get(key)?.as_str()?.to_owned());
    Ok(packages
        .iter()
        .filter_map(|p| {
            Some((
                (word(p, "name")?, word(p, "version")?),
                word(p, "checksum")?,
            ))
        })
        .collect())
}

/// What cargo says of all packages, with all features and for [`PLATFORMS`].
pub(crate) fn metadata() -> Result<Value> {
    let mut command = cargo(&["metadata", "--locked", "--format-version", "1"]);
    command.arg("--all-features");
    for platform in PLATFORMS {
        command.args(["--filter-platform", platform]);
    }
    let output = command.output().context("cargo does not run")?;
    ensure!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(serde_json::from_slice(&output.stdout)?)
}

pub(crate) fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

pub(crate) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_tree_names_a_package() {
        let line = "paste v1.0.15 (proc-macro)";
        assert_eq!(name_and_version(line), Some(("paste", "1.0.15")));
        assert_eq!(name_and_version(""), None);
    }
}
