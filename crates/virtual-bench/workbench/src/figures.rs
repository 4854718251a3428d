//! Figures that are counted and come out the same on every machine: one file holds them, which README and docs quote.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::Result;

use xtask::cargo::workspace;

/// The counts of the control tick.
const CONTROL_TICK: &str = "docs/figures/control-tick.md";

/// Writes what was counted of the control tick, and returns where.
pub(crate) fn write_control_tick(counts: &[(String, String)]) -> Result<PathBuf> {
    let path = workspace().join(CONTROL_TICK);
    let heading = "# Instructions of the control tick\n\n\
                   `cargo xtask bench` counts them under QEMU and writes this file; every run counts the same. \
                   README.md quotes it.\n\n\
                   | figure | counted |\n|---|---|\n";
    fs::create_dir_all(path.parent().unwrap_or(workspace()))?;
    fs::write(&path, format!("{heading}{}", rows(counts)))?;
    Ok(path)
}

/// The rows of a table.
pub(crate) fn rows(counts: &[(String, String)]) -> String {
    counts
        .iter()
        .fold(String::new(), |mut rows, (what, count)| {
            let _ = writeln!(rows, "| {what} | {count} |");
            rows
        })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Every count of instructions in a text, as `123 instructions`.
    fn counts_in(text: &str) -> Vec<String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        words
            .windows(2)
            .filter(|pair| pair[1].starts_with("instructions") && pair[0].parse::<u32>().is_ok())
            .map(|pair| format!("{} instructions", pair[0]))
            .collect()
    }

    /// All pages below a folder.
    fn pages(folder: &Path) -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("the folder is there");
        let paths = entries.map(|entry| entry.expect("it can be read").path());
        paths
            .flat_map(|path| match path.is_dir() {
                true => pages(&path),
                false => vec![path],
            })
            .filter(|path| path.extension().is_some_and(|end| end == "md"))
            .collect()
    }

    #[test]
    fn the_readme_quotes_every_count_and_no_page_another() {
        let read = |path: &Path| fs::read_to_string(path).expect("the page can be read");
        let counted = read(&workspace().join(CONTROL_TICK));
        let rows: Vec<&str> = counted
            .lines()
            .filter(|line| line.ends_with(" instructions |"))
            .collect();
        assert!(!rows.is_empty(), "{CONTROL_TICK} holds no counts");
        let readme = workspace().join("README.md");
        for row in &rows {
            assert!(read(&readme).contains(row), "README.md lacks `{row}`");
        }
        for page in pages(&workspace().join("docs")).into_iter().chain([readme]) {
            for count in counts_in(&read(&page)) {
                assert!(
                    rows.iter().any(|row| row.contains(&format!("| {count} |"))),
                    "{} says {count}, which {CONTROL_TICK} does not",
                    page.display()
                );
            }
        }
    }

    #[test]
    fn counts_are_found_in_tables_and_in_sentences() {
        let text = "| whole tick | 1547 instructions |\nIt takes 364 instructions, some instructions more.";
        assert_eq!(counts_in(text), ["1547 instructions", "364 instructions"]);
    }
}
