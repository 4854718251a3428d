//! The sources of this workspace, as its checks read them.

use std::fs;
use std::path::{Path, PathBuf};

/// What is built or fetched, and is nobody's source.
const NOT_OURS: [&str; 3] = ["target", "node_modules", ".git"];

/// The files of Rust below a folder, in the order of their names; those of tests, benches and examples left out.
pub(crate) fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            let is_for_tests =
                ["tests", "tests.rs", "benches", "examples"].contains(&name.as_str());
            if is_for_tests || NOT_OURS.contains(&name.as_str()) {
                continue;
            }
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}
