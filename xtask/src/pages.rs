//! README and the pages of `docs`: no link leads nowhere, every page is reached, and what pages and comments name is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::cargo::workspace;

/// Folders of the project that pages and comments name files in.
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
/// How the names of sources end whose comments are read.
const SOURCES: [&str; 4] = ["rs", "toml", "py", "js"];

/// README and all pages of `docs`.
pub(crate) fn all() -> BTreeSet<PathBuf> {
    let mut pages = files_below(&workspace().join("docs"), &["md"]);
    pages.insert(workspace().join("README.md"));
    pages
}

/// The files below a folder whose names end so. Folders that git does not keep, and hidden ones, are left out.
fn files_below(folder: &Path, endings: &[&str]) -> BTreeSet<PathBuf> {
    let mut files = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if path.is_dir() {
            if !name.starts_with('.') && name != "target" && name != "node_modules" {
                files.extend(files_below(&path, endings));
            }
        } else if path
            .extension()
            .is_some_and(|end| endings.iter().any(|ending| end == *ending))
        {
            files.insert(path);
        }
    }
    files
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

#[test]
fn every_page_is_reached_from_the_readme_and_no_link_leads_nowhere() {
    let whole = |path: PathBuf| path.canonicalize().expect("it is there");
    let reached = reached_from(whole(workspace().join("README.md")));
    let pages: BTreeSet<PathBuf> = all().into_iter().map(whole).collect();
    assert!(pages.len() > 40, "{} pages", pages.len());
    let lost: Vec<_> = pages.difference(&reached).collect();
    assert!(lost.is_empty(), "no link leads to {lost:?}");
}

/// The paths of the project that a page names in backticks, `{a,b}` written out. Those with a `*` are patterns.
fn paths_in_page(page: &str) -> Vec<String> {
    let quoted = page.split('`').skip(1).step_by(2);
    quoted
        .filter(|word| lies_in_a_folder(word) && !word.contains([' ', '*']))
        .flat_map(written_out)
        .collect()
}

fn lies_in_a_folder(path: &str) -> bool {
    let begins = |folder: &&str| path.starts_with(&format!("{folder}/"));
    FOLDERS.iter().any(begins)
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
    let named: Vec<(PathBuf, String)> = all()
        .into_iter()
        .flat_map(|page| {
            let text = fs::read_to_string(&page).expect("a page");
            let named = paths_in_page(&text).into_iter();
            named.map(move |path| (page.clone(), path))
        })
        .collect();
    assert!(named.len() > 50, "{} paths", named.len());
    let lost: Vec<_> = named
        .iter()
        .filter(|(_, path)| !workspace().join(path).exists())
        .collect();
    assert!(lost.is_empty(), "not there: {lost:#?}");
}

/// The files of the project that comments name: words that lie in one of its folders and have an ending. `NAME` and `*` stand
/// for any.
fn paths_in_comments(source: &str) -> Vec<&str> {
    source
        .lines()
        .filter_map(|line| {
            let line = line.trim_start();
            line.strip_prefix("//").or_else(|| line.strip_prefix('#'))
        })
        .flat_map(|comment| comment.split(|c: char| c.is_whitespace() || "`()[]\"',;".contains(c)))
        .map(|word| word.trim_end_matches(['.', ':']).trim_start_matches("../"))
        .filter(|word| {
            let has_ending = Path::new(word).extension().is_some();
            lies_in_a_folder(word)
                && has_ending
                && !word.contains(['*', '{', '<'])
                && !word.contains("NAME")
        })
        .collect()
}

/// The folder of the package that a file belongs to.
fn package_of(file: &Path) -> &Path {
    file.ancestors()
        .find(|folder| folder.join("Cargo.toml").exists())
        .unwrap_or(workspace())
}

#[test]
fn what_a_comment_names_of_the_project_is_there() {
    let mut lost = Vec::new();
    let mut count = 0;
    for source in files_below(workspace(), &SOURCES) {
        let Ok(text) = fs::read_to_string(&source) else {
            continue;
        };
        for path in paths_in_comments(&text) {
            count += 1;
            // A comment may leave out the folder of its own package.
            let places = [workspace(), package_of(&source)];
            if !places.iter().any(|place| place.join(path).exists()) {
                lost.push(format!("{}: {path}", source.display()));
            }
        }
    }
    assert!(count > 50, "{count} paths");
    assert!(lost.is_empty(), "not there: {lost:#?}");
}

/// What a page cites, in brackets: names, and a year.
fn citations(page: &str) -> Vec<(String, &str)> {
    let bracketed = page
        .split('[')
        .skip(1)
        .filter_map(|rest| rest.split_once(']'))
        .filter(|(_, after)| !after.starts_with('('))
        .map(|(inside, _)| inside);
    bracketed
        .flat_map(|inside| inside.split(';'))
        .filter_map(|part| {
            let part = part
                .split(',')
                .next()
                .expect("one part at least")
                .trim_end();
            let (names, year) = part.rsplit_once(char::is_whitespace)?;
            let is_year = year.len() == 4 && year.parse::<u16>().is_ok();
            let names = names.split_whitespace().collect::<Vec<_>>().join(" ");
            (is_year && names.starts_with(char::is_uppercase)).then_some((names, year))
        })
        .collect()
}

#[test]
fn what_a_page_cites_is_in_the_bibliography() {
    let read = |path: &Path| fs::read_to_string(path).expect("a page");
    let bibliography = read(&workspace().join("docs/theory/bibliography.md"));
    let entries: Vec<&str> = bibliography.split("\n- ").collect();
    let has = |names: &str, year: &str| {
        entries.iter().any(|entry| {
            let mut names = names.trim_end_matches(" et al.").split(" and ");
            names.all(|name| entry.contains(name)) && entry.contains(year)
        })
    };
    let mut cited = 0;
    for page in all() {
        for (names, year) in citations(&read(&page)) {
            cited += 1;
            assert!(
                has(&names, year),
                "{} cites {names} {year}, which the bibliography lacks",
                page.display()
            );
        }
    }
    assert!(cited > 20, "{cited} citations");
}

#[test]
fn the_architecture_lists_every_crate() {
    let page = workspace().join("docs/developing/architecture.md");
    let text = fs::read_to_string(page).expect("the architecture");
    let listed: BTreeSet<&str> = text.split_whitespace().collect();
    let below = |folder: PathBuf| {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").path())
    };
    let crates = below(workspace().join("crates"))
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

/// The names that a page sets off in the block after a sentence, one a line.
fn names_after<'a>(page: &'a str, sentence: &str) -> Vec<&'a str> {
    let (_, after) = page.split_once(sentence).expect("the sentence");
    let block = after.lines().skip_while(|line| !line.starts_with("    "));
    block
        .take_while(|line| line.starts_with("    "))
        .filter_map(|line| line.split_whitespace().next())
        .collect()
}

#[test]
fn the_core_s_stages_lie_in_files_of_their_names() {
    let page = workspace().join("docs/developing/architecture.md");
    let text = fs::read_to_string(page).expect("the architecture");
    let stages = names_after(&text, "The core's stages lie in files of their names");
    assert!(stages.len() > 5, "{stages:?}");
    let folder = workspace().join("crates/board/control-core/src");
    for stage in stages {
        assert!(folder.join(format!("{stage}.rs")).exists(), "{stage}");
    }
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(workspace().join("README.md")).expect("the README");
    // A reader sees it whole in two or three screens.
    let lines = readme.lines().count();
    assert!(lines <= 120, "{lines} lines");
}

#[test]
fn braces_are_written_out() {
    assert_eq!(written_out("a/{b,c}.rs"), ["a/b.rs", "a/c.rs"]);
    assert_eq!(written_out("a/b.rs"), ["a/b.rs"]);
}

#[test]
fn files_are_found_in_comments() {
    let source = "//! See `docs/board.md`, and docs/faults/NAME.md.\nlet path = \"docs/b.md\";\n# (src/main.rs)\n";
    assert_eq!(paths_in_comments(source), ["docs/board.md", "src/main.rs"]);
}

#[test]
fn citations_are_found_and_links_are_not() {
    let page = "as [Page 1954], [Lawson and\nHanson 1974, chapter 23; Stark and Parker 1995], and [Page 1](a.md)";
    assert_eq!(
        citations(page),
        [
            ("Page".to_owned(), "1954"),
            ("Lawson and Hanson".to_owned(), "1974"),
            ("Stark and Parker".to_owned(), "1995")
        ]
    );
}
