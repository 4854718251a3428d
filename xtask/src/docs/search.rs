//! The book in a browser, opened as a file: every page opens without a complaint, with all its pictures, and a word that is
//! typed into the search leads to pages that hold it.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};
use headless_browser::Browser;

use super::links::pages_below;
use crate::cargo::target_directory;

/// What is searched for: a word of many pages, and one that no page holds.
const WORD: &str = "hysteresis";
const NO_WORD: &str = "xylophone";
/// mdBook's key for its search.
const SEARCH_KEY: &str = "s";
/// Where its results are.
const RESULTS: &str = "#mdbook-searchresults a";

/// Fails where a reader without a network would miss something.
pub(super) fn check(browser: &OsStr, book: &Path) -> Result<()> {
    let profile = target_directory().join("browser");
    if profile.exists() {
        fs::remove_dir_all(&profile)?;
    }
    let mut browser = Browser::start(browser, &profile)?;
    let tried = try_out(&mut browser, book);
    let complaints = &browser.complaints;
    ensure!(
        complaints.is_empty(),
        "pages complain in the browser, or fetch what is no file:\n  {}",
        complaints.join("\n  ")
    );
    tried
}

fn try_out(browser: &mut Browser, book: &Path) -> Result<()> {
    let count = open_all(browser, book)?;
    println!("{count} pages open in a browser, with all their pictures");
    let first = book.join("index.html");
    let found = search(browser, &first, WORD)?;
    ensure!(!found.is_empty(), "the search finds no page for {WORD}");
    browser.open(&found[0])?;
    let text = browser.value("document.querySelector('main').innerText.toLowerCase()")?;
    ensure!(
        text.as_str().is_some_and(|text| text.contains(WORD)),
        "the search leads to {}, which does not hold {WORD}",
        found[0]
    );
    let none = search(browser, &first, NO_WORD)?;
    ensure!(none.is_empty(), "the search finds {NO_WORD} in {none:?}");
    println!(
        "the search works from a file: {WORD} is found {} times",
        found.len()
    );
    Ok(())
}

/// Opens every page, and counts them.
fn open_all(browser: &mut Browser, book: &Path) -> Result<usize> {
    let mut pages = Vec::new();
    pages_below(book, &mut pages)?;
    for page in &pages {
        browser.open_file(page)?;
        let lost = browser.value(
            "[...document.images].filter((image) => !image.naturalWidth).map((image) => image.src).join(' ')",
        )?;
        ensure!(lost == "", "{} does not show {lost}", page.display());
    }
    Ok(pages.len())
}

/// The addresses that a search for `word` leads to, as a reader would search.
fn search(browser: &mut Browser, first: &Path, word: &str) -> Result<Vec<String>> {
    browser.open_file(first)?;
    browser.types(SEARCH_KEY)?;
    // The index is loaded when it is first needed, and what is found is said in words.
    browser.wait_until("document.activeElement?.id === 'mdbook-searchbar'")?;
    browser.types(word)?;
    let said = "document.getElementById('mdbook-searchresults-header').innerText";
    browser.wait_until(&format!("{said}.includes('{word}')"))?;
    let found = browser.value(&format!(
        "[...document.querySelectorAll('{RESULTS}')].map((link) => link.href)"
    ))?;
    let found = found.as_array().into_iter().flatten();
    Ok(found
        .filter_map(|link| link.as_str().map(str::to_owned))
        .collect())
}
