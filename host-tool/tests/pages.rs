//! The pages of `docs`: no link leads nowhere, every page is reached from the contents, and the index of faults is whole.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn project() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    here.canonicalize().expect("the project")
}

/// The files and folders of the project that a page links to.
fn links(page: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(page).expect("a page");
    let targets = text.split("](").skip(1);
    targets
        .map(|target| target.split([')', '#']).next().expect("one part at least"))
        .filter(|target| !target.is_empty() && !target.starts_with("http"))
        .map(|target| {
            let path = page.parent().expect("a folder").join(target);
            let found = path.canonicalize();
            found.unwrap_or_else(|_| {
                panic!("{} links to {target}, which is not there", page.display())
            })
        })
        .collect()
}

/// All pages that one leads to by links, itself included.
fn reached_from(page: PathBuf) -> BTreeSet<PathBuf> {
    let mut reached = BTreeSet::from([page.clone()]);
    let mut open = vec![page];
    while let Some(page) = open.pop() {
        for link in links(&page) {
            let is_page = link.extension().is_some_and(|end| end == "md");
            if is_page && reached.insert(link.clone()) {
                open.push(link);
            }
        }
    }
    reached
}

fn pages_below(folder: &Path) -> BTreeSet<PathBuf> {
    let mut pages = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            pages.extend(pages_below(&path));
        } else if path.extension().is_some_and(|end| end == "md") {
            pages.insert(path);
        }
    }
    pages
}

#[test]
fn every_page_is_reached_from_the_readme_and_no_link_leads_nowhere() {
    let reached = reached_from(project().join("README.md"));
    let pages = pages_below(&project().join("docs"));
    assert!(pages.len() > 40, "{} pages", pages.len());
    let lost: Vec<_> = pages.difference(&reached).collect();
    assert!(lost.is_empty(), "no link leads to {lost:?}");
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(project().join("README.md")).expect("the README");
    // A reader sees it whole in two or three screens.
    assert!(readme.lines().count() <= 130);
}
