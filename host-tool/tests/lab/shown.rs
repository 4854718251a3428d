//! What the README and the pages of `docs` show of the tool: indented blocks, and when two lines say the same.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// What shown lines begin with.
pub(crate) const INDENT: &str = "    ";

/// The folder of the workspace.
pub(crate) fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The README and everything below `docs`.
pub(crate) fn pages() -> BTreeSet<PathBuf> {
    let mut pages = BTreeSet::from([project().join("README.md")]);
    let mut folders = vec![project().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "md") {
                pages.insert(path);
            }
        }
    }
    pages
}

/// The indented blocks of a page: lines with no prose between them, each with its number.
pub(crate) fn blocks(page: &str) -> Vec<Vec<(usize, &str)>> {
    let mut blocks = vec![Vec::new()];
    for (number, line) in page.lines().enumerate() {
        match line.strip_prefix(INDENT) {
            Some(shown) => blocks
                .last_mut()
                .expect("one at least")
                .push((number, shown)),
            None if line.is_empty() => {}
            None => blocks.push(Vec::new()),
        }
    }
    blocks.retain(|block| !block.is_empty());
    blocks
}

/// A line's words without the little pictures.
fn words(line: &str) -> Vec<&str> {
    line.split(|c: char| c.is_whitespace() || "(),;".contains(c))
        .filter(|word| word.is_ascii() && !word.is_empty())
        .collect()
}

/// Whether two lines say the same: words alike, and numbers where `same` says so.
pub(crate) fn alike(shown: &str, said: &str, same: impl Fn(&str, &str) -> bool) -> bool {
    let (shown, said) = (words(shown), words(said));
    let same_word = |(a, b): (&&str, &&str)| match (number(a), number(b)) {
        (Some(_), Some(_)) => same(a, b),
        _ => a == b,
    };
    shown.len() == said.len() && shown.iter().zip(&said).all(same_word)
}

pub(crate) fn number(word: &str) -> Option<f64> {
    word.trim_end_matches('%').parse().ok()
}
