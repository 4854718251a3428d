//! The pages of `docs` as a book for a browser, with a search that needs no network: made by mdBook of what the repository
//! holds, which has no page in mdBook's own format.

mod contents;
mod links;
mod search;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use self::contents::Contents;
use crate::cargo::{cargo, run, target_directory, workspace};
use crate::setup;

/// Tried with this version; its search works from a file, and nothing in its pages comes from elsewhere.
const MDBOOK: &str = "0.5.4";
/// What mdBook reads beside the pages, by name.
const CONFIGURATION: [(&str, &str); 2] = [
    ("book.toml", include_str!("book.toml")),
    ("book.css", include_str!("book.css")),
];
/// The page that the book opens with, and from which every other is reached.
const FIRST: &str = "README.md";

/// Makes the book; with `check`, tries its links and, in a browser, its search; with `open`, shows it.
pub(crate) fn build(check: bool, open: bool) -> Result<()> {
    let (sources, book) = (target_directory().join("book"), folder());
    for made in [&sources, &book] {
        if made.exists() {
            fs::remove_dir_all(made)?;
        }
    }
    let contents = Contents::of(workspace(), Path::new(FIRST))?;
    contents.copy(workspace(), &sources.join("src"))?;
    fs::write(sources.join("src/SUMMARY.md"), contents.summary())?;
    for (name, text) in CONFIGURATION {
        fs::write(sources.join(name), text)?;
    }
    run(Command::new(mdbook()?)
        .args(["build", "--dest-dir"])
        .arg(&book)
        .arg(&sources))?;
    let first = book.join("index.html");
    println!("{} pages: {}", contents.pages(), first.display());
    if check {
        let links = links::check(&book)?;
        println!("{links} links lead to what is there");
        search::check(&setup::browser()?, &book)?;
    }
    if open {
        run(Command::new("xdg-open").arg(&first))
            .with_context(|| format!("open {} yourself", first.display()))?;
    }
    Ok(())
}

/// Where the book is. rustdoc's is another folder.
fn folder() -> PathBuf {
    target_directory().join("docs")
}

/// mdBook, built where it is missing: without what watches and serves, some two minutes, once.
fn mdbook() -> Result<PathBuf> {
    let root = target_directory().join("mdbook");
    let program = root.join("bin/mdbook");
    let version = |program: &Path| {
        let said = Command::new(program).arg("--version").output().ok()?;
        Some(String::from_utf8_lossy(&said.stdout).trim().to_owned())
    };
    let wanted = Some(format!("mdbook v{MDBOOK}"));
    if version(&program) == wanted {
        return Ok(program);
    }
    eprintln!("mdBook {MDBOOK} is missing; building it for this workspace alone.");
    let mut install = cargo(&["install", "--quiet", "--locked", "--force", "--root"]);
    install
        .arg(&root)
        .args(["--no-default-features", "--features", "search"]);
    run(install.arg(format!("mdbook@{MDBOOK}")))
        .context("mdBook's sources come from crates.io; is there a network?")?;
    ensure!(
        version(&program) == wanted,
        "{} is not the mdBook that was built",
        program.display()
    );
    Ok(program)
}
