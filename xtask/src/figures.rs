//! Figures that README quotes: each has one home, a page of `docs/figures`.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::cargo::workspace;

/// The counts of the control tick.
const CONTROL_TICK: &str = "docs/figures/control-tick.md";
/// What the driver board's image takes, and how fast the emulator is.
const BOARD: &str = "docs/figures/board.md";
/// The row that has the size of the driver board's image.
const IMAGE: &str = "flash and static RAM of the STM32G474RE image";
/// By so much of itself a size may be off in the pages: nobody is to write them anew for a changed line, and what is off by
/// more is from another month.
const OFF: f64 = 0.03;

/// Writes what was counted of the control tick, and returns where.
///
/// # Errors
/// Where it cannot be written.
pub fn write_control_tick(counts: &[(String, String)]) -> Result<PathBuf> {
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
#[must_use]
pub fn rows(counts: &[(String, String)]) -> String {
    counts
        .iter()
        .fold(String::new(), |mut rows, (what, count)| {
            let _ = writeln!(rows, "| {what} | {count} |");
            rows
        })
}

/// Fails where the page says another size of the driver board's image than it has (bytes of flash, of static RAM).
pub(crate) fn check_image(flash: u64, ram: u64) -> Result<()> {
    let page = fs::read_to_string(workspace().join(BOARD))?;
    let told = sizes(&page).with_context(|| format!("{BOARD} has no row `{IMAGE}`"))?;
    let is_off = |told: u64, is: u64| told.abs_diff(is) as f64 > OFF * is as f64;
    ensure!(
        !is_off(told.0, flash) && !is_off(told.1, ram),
        "{BOARD} and README.md say another size of the image: write there `| {IMAGE} | {} B, {} B |`",
        grouped(flash),
        grouped(ram)
    );
    Ok(())
}

/// What a page says of flash and static RAM (bytes).
fn sizes(page: &str) -> Option<(u64, u64)> {
    let row = page
        .lines()
        .find_map(|line| line.strip_prefix(&format!("| {IMAGE} | ")))?;
    let (flash, ram) = row.split_once(',')?;
    let number = |text: &str| {
        let digits: String = text.chars().filter(char::is_ascii_digit).collect();
        digits.parse().ok()
    };
    Some((number(flash)?, number(ram)?))
}

/// 160032 as `160 032`, below a million.
fn grouped(number: u64) -> String {
    match (number / 1000, number % 1000) {
        (0, rest) => rest.to_string(),
        (thousands, rest) => format!("{thousands} {rest:03}"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::pages;

    /// Every count of instructions in a text, as `123 instructions`.
    fn counts_in(text: &str) -> Vec<String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        words
            .windows(2)
            .filter(|pair| pair[1].starts_with("instructions") && pair[0].parse::<u32>().is_ok())
            .map(|pair| format!("{} instructions", pair[0]))
            .collect()
    }

    fn read(page: &str) -> String {
        fs::read_to_string(workspace().join(page)).expect("the page can be read")
    }

    /// The rows of a page's tables, the lines below their headings left out.
    fn rows_of(page: &str) -> impl Iterator<Item = &str> {
        page.lines()
            .filter(|line| line.starts_with("| ") && line.ends_with(" |"))
    }

    /// What a row says of `figure`, cell by cell.
    fn cells<'a>(page: &'a str, figure: &str) -> Vec<&'a str> {
        let row = rows_of(page)
            .find_map(|row| row.strip_prefix(&format!("| {figure} | ")))
            .unwrap_or_else(|| panic!("no row `{figure}`"));
        row.trim_end_matches(" |").split(" | ").collect()
    }

    #[test]
    fn no_page_says_another_count_than_was_counted() {
        let counted = read(CONTROL_TICK);
        let rows: Vec<&str> = counted
            .lines()
            .filter(|line| line.ends_with(" instructions |"))
            .collect();
        assert!(!rows.is_empty(), "{CONTROL_TICK} holds no counts");
        for page in pages::all() {
            for count in counts_in(&fs::read_to_string(&page).expect("a page")) {
                assert!(
                    rows.iter().any(|row| row.contains(&format!("| {count} |"))),
                    "{} says {count}, which {CONTROL_TICK} does not",
                    page.display()
                );
            }
        }
    }

    #[test]
    fn every_figure_of_the_readme_stands_in_a_page_of_figures() {
        let folder = fs::read_dir(workspace().join("docs/figures")).expect("the folder is there");
        let homes = folder
            .map(|entry| fs::read_to_string(entry.expect("an entry").path()).expect("a page"))
            .collect::<String>();
        let homes: BTreeSet<&str> = rows_of(&homes).collect();
        let readme = read("README.md");
        let (_, figures) = readme
            .split_once("\n## Figures\n")
            .expect("README has figures");
        let quoted: Vec<&str> = rows_of(figures).skip(1).collect();
        assert!(quoted.len() > 10, "{} figures", quoted.len());
        let lost: Vec<_> = quoted.iter().filter(|row| !homes.contains(*row)).collect();
        assert!(lost.is_empty(), "in no page of docs/figures: {lost:#?}");
    }

    #[test]
    fn what_the_readme_says_of_five_mirrors_is_what_their_table_says() {
        let page = read("docs/figures/positioning.md");
        // The first cell is the paper's mirror uncompensated, the last what is required.
        let range_of = |figure: &str| {
            let row = cells(&page, figure);
            let (first, rest) = row.split_first().expect("a row has cells");
            assert!(rest.len() == 6, "{figure}: {first} and {rest:?}");
            let mut values: Vec<&str> = rest[..5]
                .iter()
                .map(|cell| cell.split(' ').next().expect("a number"))
                .collect();
            values.sort_by(|a, b| a.parse::<f64>().unwrap().total_cmp(&b.parse().unwrap()));
            format!("{} to {}", values[0], values[4])
        };
        let at_rest = range_of("static error, rms");
        let up = range_of("t95 20 to 90 um (limit)");
        let quoted = cells(
            &page,
            "static error after calibration, five virtual mirrors, rms",
        );
        assert_eq!(quoted, [format!("{at_rest} um")]);
        let quoted = cells(&page, "time to 95 % of a step of 70 um, up");
        assert_eq!(quoted, [format!("{up} ms")]);
    }

    #[test]
    fn sizes_are_read_as_they_are_written() {
        let page = format!("| {IMAGE} | {} B, {} B |\n", grouped(160_032), grouped(956));
        assert_eq!(page, format!("| {IMAGE} | 160 032 B, 956 B |\n"));
        assert_eq!(sizes(&page), Some((160_032, 956)));
        assert_eq!(grouped(29_008), "29 008");
        assert_eq!(sizes("| something else | 1 B, 2 B |"), None);
    }

    #[test]
    fn counts_are_found_in_tables_and_in_sentences() {
        let text = "| whole tick | 1547 instructions |\nIt takes 364 instructions, some instructions more.";
        assert_eq!(counts_in(text), ["1547 instructions", "364 instructions"]);
    }

    /// The board's design has two poles in its output filter; each text that says how late they are says what they make.
    #[test]
    fn every_text_says_the_same_lag_of_the_output_filter() {
        let design = read("crates/board/control-core/src/design.rs");
        let (_, corner) = design
            .split_once("OUTPUT_FILTER_HZ: f32 = ")
            .expect("the corner");
        let (corner_hz, _) = corner.split_once(';').expect("a number");
        let corner_hz: f64 = corner_hz.parse().expect("a number");
        let lag_ms = 1e3 * 2.0 / (std::f64::consts::TAU * corner_hz);
        for (page, before) in [
            ("docs/board.md", "2 / (2 pi 2 kHz) = "),
            ("docs/developing/architecture.md", "2/(2 pi 2 kHz) = "),
            (
                "crates/virtual-bench/closed-loop/src/lib.rs",
                "2 / (2 pi 2 kHz) = ",
            ),
            (
                "crates/board/control-core/src/resistance.rs",
                "two poles of the output filter, ",
            ),
        ] {
            let text = read(page).replace("//!", " ").replace("///", " ");
            let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            let (_, said) = text.split_once(before).expect(page);
            let (said, _) = said.split_once(" ms").expect(page);
            let digits = said.len() - said.find('.').expect("decimals") - 1;
            assert_eq!(said, format!("{lag_ms:.digits$}"), "{page}");
        }
    }
}
