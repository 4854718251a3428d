//! The pages of `docs`: no link leads nowhere, every page is reached from the README, and what they name is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use clap_markdown::MarkdownOptions;
use host_tool::cli::Arguments;

/// Folders of the project that pages name files in.
const FOLDERS: [&str; 11] = [
    "benches",
    "crates",
    "data",
    "docs",
    "hil",
    "host-tool",
    "packaging",
    "python",
    "src",
    "tests",
    "xtask",
];

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

/// The paths of the project that a page names in backticks, `{a,b}` written out. Those with a `*` are patterns.
fn named_paths(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).expect("a page");
    let is_path = |word: &&str| {
        let begins = |folder: &&str| word.starts_with(&format!("{folder}/"));
        FOLDERS.iter().any(begins) && !word.contains([' ', '*'])
    };
    let quoted = text.split('`').skip(1).step_by(2);
    quoted.filter(is_path).flat_map(written_out).collect()
}

/// `a/{b,c}.rs` as `a/b.rs` and `a/c.rs`.
fn written_out(path: &str) -> Vec<String> {
    let (Some((before, rest)), Some((_, after))) = (path.split_once('{'), path.split_once('}'))
    else {
        return vec![path.to_owned()];
    };
    let parts = rest.split('}').next().expect("one part at least");
    let whole = |part| format!("{before}{part}{after}");
    parts.split(',').map(whole).collect()
}

#[test]
fn what_a_page_names_of_the_project_is_there() {
    let mut pages = pages_below(&project().join("docs"));
    pages.insert(project().join("README.md"));
    let named: Vec<(PathBuf, String)> = pages
        .into_iter()
        .flat_map(|page| {
            named_paths(&page)
                .into_iter()
                .map(move |path| (page.clone(), path))
        })
        .collect();
    assert!(named.len() > 50, "{} paths", named.len());
    let lost: Vec<_> = named
        .iter()
        .filter(|(_, path)| !project().join(path).exists())
        .collect();
    assert!(lost.is_empty(), "not there: {lost:#?}");
}

#[test]
fn the_architecture_lists_every_crate() {
    let page = project().join("docs/developing/architecture.md");
    let text = fs::read_to_string(page).expect("the architecture");
    let listed: BTreeSet<&str> = text.split_whitespace().collect();
    let below = |folder: PathBuf| {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").path())
    };
    let crates = below(project().join("crates"))
        .flat_map(below)
        .filter(|path| path.join("Cargo.toml").exists());
    let lost: Vec<PathBuf> = crates
        .filter(|path| {
            let name = path.file_name().expect("a name").to_string_lossy();
            !listed.contains(&*name)
        })
        .collect();
    assert!(lost.is_empty(), "not in the list of parts: {lost:?}");
}

/// Stands above what the tool says of its own options.
const ABOVE_OPTIONS: &str = "\
# All options

What `host-tool COMMAND --help` says, of all commands. [Commands](commands.md) has them by what they are for. It is made from the tool
by `MIRROR_WRITE_PAGES=1 cargo test -p host-tool --test pages`.

";

#[test]
fn the_page_of_options_is_what_the_tool_says_of_them() {
    let plain = MarkdownOptions::new()
        .title("host-tool".to_owned())
        .show_footer(false);
    let told = clap_markdown::help_markdown_custom::<Arguments>(&plain);
    let start = told
        .find("**Command Overview:**")
        .expect("a list of commands");
    let told = &told[start..];
    let lines = told.lines().map(|line| format!("{}\n", line.trim_end()));
    let expected = format!("{ABOVE_OPTIONS}{}\n", lines.collect::<String>().trim());
    let page = project().join("docs/reference/options.md");
    if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
        fs::write(&page, &expected).expect("written");
    }
    let is_the_same = fs::read_to_string(page).is_ok_and(|page| page == expected);
    assert!(
        is_the_same,
        "write it anew: MIRROR_WRITE_PAGES=1 cargo test -p host-tool --test pages"
    );
}

#[test]
fn braces_are_written_out() {
    assert_eq!(written_out("a/{b,c}.rs"), ["a/b.rs", "a/c.rs"]);
    assert_eq!(written_out("a/b.rs"), ["a/b.rs"]);
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(project().join("README.md")).expect("the README");
    // A reader sees it whole in two or three screens.
    assert!(readme.lines().count() <= 130);
}
