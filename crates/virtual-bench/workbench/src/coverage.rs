//! How much of the flashed image's code the silicon twin executes in the acceptance checks and under random traffic, by function.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};
use silicon_twin::Image;
use silicon_twin::coverage::{Coverage, Covered, FOLDER};
use xtask::cargo::{cargo, workspace};
use xtask::images::{self, Board};
use xtask::tool;

/// The page that it is written to.
const PAGE: &str = "docs/figures/coverage.md";
/// Functions that are listed by name: the largest.
const LISTED: usize = 60;

/// What runs the image, and its name: package, program of tests, filter, and whether all of it is tried.
const RUNS: [(&str, [&str; 3]); 2] = [
    ("acceptance checks", ["hil", "acceptance", ""]),
    ("random traffic", ["silicon-twin", "flashed", "fuzz"]),
];

/// Measures it, prints it and writes the page.
pub(crate) fn run() -> Result<()> {
    let image = images::build(Board::Stm32g474)?;
    tool::build()?;
    let image = Image::from_elf(&fs::read(image)?)?;
    let mut runs = Vec::new();
    for (name, words) in RUNS {
        let folder = tempfile::tempdir()?;
        let status = command(words, folder.path()).status()?;
        ensure!(status.success(), "the {name} fail");
        runs.push(Coverage::load_all(folder.path())?);
    }
    let page = page(&image, &runs);
    print!("{page}");
    let path = workspace().join(PAGE);
    fs::write(&path, &page)?;
    eprintln!("Wrote {}.", path.display());
    Ok(())
}

fn command([package, program, filter]: [&str; 3], folder: &Path) -> Command {
    let mut command = cargo(&["test", "--package", package, "--test", program, "--"]);
    command
        .args((!filter.is_empty()).then_some(filter))
        .env("MIRROR_EMULATOR", "g474")
        .env(FOLDER, folder);
    command
}

/// A table of what each run executed, and both of them.
fn page(image: &Image, runs: &[Coverage]) -> String {
    let mut all = Coverage::default();
    runs.iter().for_each(|run| all.merge(run));
    let mut columns: Vec<Vec<Covered>> = runs.iter().map(|run| run.by_function(image)).collect();
    columns.push(all.by_function(image));
    let mut page = String::from(
        "# Coverage of the flashed image\n\n\
         `cargo xtask bench coverage` runs it on the silicon twin and writes this file: bytes of instructions that were \
         executed, by function; constants that lie behind a function's code count as its bytes.\n\n\
         | function | bytes | acceptance checks | random traffic | both |\n|---|---|---|---|---|\n",
    );
    let percent = |executed: usize, bytes: usize| 100.0 * executed as f64 / bytes.max(1) as f64;
    let mut row = |name: &str, bytes: usize, executed: Vec<usize>| {
        let _ = write!(page, "| {name} | {bytes} |");
        for executed in executed {
            let _ = write!(page, " {:.0} % |", percent(executed, bytes));
        }
        page.push('\n');
    };
    let sum = |column: &[Covered]| column.iter().map(|function| function.executed).sum();
    let bytes = columns[0].iter().map(|function| function.bytes).sum();
    row(
        "all",
        bytes,
        columns.iter().map(|column| sum(column)).collect(),
    );
    for (i, function) in columns[0].iter().take(LISTED).enumerate() {
        let executed = columns.iter().map(|column| column[i].executed).collect();
        row(&format!("`{}`", function.name), function.bytes, executed);
    }
    let both = columns.last().map(Vec::as_slice).unwrap_or_default();
    let never = both.iter().filter(|function| function.executed == 0);
    let (count, bytes) = never.fold((0, 0), |(count, bytes), function| {
        (count + 1, bytes + function.bytes)
    });
    let _ = writeln!(
        page,
        "\nThe other {} functions are smaller. {count} of all {}, {bytes} bytes, were never entered.",
        both.len().saturating_sub(LISTED),
        both.len()
    );
    page
}
