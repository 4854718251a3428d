//! That `cargo xtask`, built by itself, shares what it is built from with the whole workspace.
//!
//! cargo unites the features of the packages that it is told to build. What has other features in a smaller selection is
//! built once more for it, and so is everything that uses it.

use std::collections::BTreeSet;

use crate::cargo::{ON_HOST, cargo};

/// Packages with their versions and features, a line each.
fn with_features(selection: &[&str]) -> BTreeSet<String> {
    let output = cargo(&["tree", "--locked", "--prefix", "none"])
        .args(["--format", "{p} [{f}]"])
        .args(selection)
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "cargo tells the packages");
    let said = String::from_utf8_lossy(&output.stdout);
    said.lines()
        .map(|line| line.trim_end_matches(" (*)").to_owned())
        .collect()
}

#[test]
fn this_package_alone_shares_the_build_of_the_workspace() {
    let alone = with_features(&["--package", "xtask", "--edges", "normal,build"]);
    let of_all = with_features(&[&ON_HOST[..], &["--edges", "normal,build,dev"]].concat());
    assert!(!alone.is_empty());
    let differing: Vec<&String> = alone.difference(&of_all).collect();
    assert!(
        differing.is_empty(),
        "built twice, with other features in the workspace (give xtask/Cargo.toml the same): {differing:?}"
    );
}
