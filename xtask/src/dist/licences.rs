//! The licences of what is inside the programs, with their texts, which most of them ask to be passed on.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::Result;

use crate::packages::{self, Package};

/// What files with such a text are called.
const NAMES: [&str; 5] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];

/// Names what `programs` are built from, and prints every licence text once.
pub(super) fn of(programs: &[&str]) -> Result<String> {
    let selection: Vec<&str> = programs
        .iter()
        .flat_map(|name| ["--package", name])
        .chain(["--edges", "normal"])
        .collect();
    let mut page = String::from("What the programs are built from, and its licences (SPDX):\n\n");
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let others = packages::built(&selection)?;
    for package in others.iter().filter(|package| package.source.is_some()) {
        let Package { name, version, .. } = package;
        let licence = package.licence.as_deref().unwrap_or("see its text");
        writeln!(page, "{name} {version}: {licence}")?;
        for text in texts_in(&package.folder)? {
            let of = texts.entry(text).or_default();
            of.push(format!("{name} {version}"));
        }
    }
    for (text, of) in texts {
        write!(page, "\n{}\n{}\n\n{text}\n", "-".repeat(80), of.join(", "))?;
    }
    Ok(page)
}

/// The licence texts in a package's folder.
fn texts_in(folder: &Path) -> Result<Vec<String>> {
    let mut texts = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().to_uppercase();
        if NAMES.iter().any(|start| name.starts_with(start)) && entry.path().is_file() {
            texts.push(
                fs::read_to_string(entry.path())?
                    .trim()
                    .replace("\r\n", "\n"),
            );
        }
    }
    Ok(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_linked_is_named_and_its_text_is_there() {
        let page = of(&["xtask"]).expect("the registry");
        assert!(page.contains("\nanyhow 1."), "not named");
        assert!(page.contains("Permission is hereby granted"), "no text");
    }
}
