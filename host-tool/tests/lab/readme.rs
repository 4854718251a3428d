//! The README and the pages of `docs`: every command that needs no board is run, and what a page shows of its output is what
//! it prints.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::common::no_boards;
use crate::lab;

/// A page's numbers are those of its day, and today's may be by this factor larger or smaller; the words around them must be
/// today's.
const DRIFT: f64 = 4.0;
/// Whole numbers may be so far off.
const COUNTS: f64 = 2.0;

/// A command, and the lines that a page shows of its output.
struct Shown {
    command: Vec<String>,
    lines: Vec<String>,
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The README and everything below `docs`.
fn pages() -> BTreeSet<PathBuf> {
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

/// The indented blocks of a page: lines with no prose between them.
fn blocks(page: &str) -> Vec<Vec<&str>> {
    let mut blocks = vec![Vec::new()];
    for line in page.lines() {
        match line.strip_prefix("    ") {
            Some(shown) => blocks.last_mut().expect("one at least").push(shown),
            None if line.is_empty() => {}
            None => blocks.push(Vec::new()),
        }
    }
    blocks.retain(|block| !block.is_empty());
    blocks
}

/// The commands of a page that need no board, in blocks of such commands only.
fn shown(page: &str) -> Vec<Shown> {
    let needs_a_board = |line: &&str| line.starts_with("host-tool>") || line.starts_with("cargo ");
    let mut shown: Vec<Shown> = Vec::new();
    for block in blocks(page) {
        if !block[0].starts_with("host-tool ") || block.iter().any(needs_a_board) {
            continue;
        }
        for line in block {
            let words: Vec<String> = line.split_whitespace().map(String::from).collect();
            match words.first().map(String::as_str) {
                Some("host-tool") => shown.push(Shown {
                    command: words[1..].to_vec(),
                    lines: Vec::new(),
                }),
                Some("...") | None => {}
                Some(_) => shown
                    .last_mut()
                    .expect("output follows a command")
                    .lines
                    .push(line.into()),
            }
        }
    }
    shown
}

/// Whether two lines say the same: words alike, numbers close, and the little pictures left aside.
fn alike(shown: &str, said: &str) -> bool {
    let words = |line: &str| -> Vec<String> {
        line.split(|c: char| c.is_whitespace() || "(),;".contains(c))
            .filter(|word| word.is_ascii() && !word.is_empty())
            .map(String::from)
            .collect()
    };
    let (shown, said) = (words(shown), words(said));
    shown.len() == said.len() && shown.iter().zip(&said).all(|(a, b)| same_word(a, b))
}

fn same_word(shown: &str, said: &str) -> bool {
    let number = |word: &str| word.trim_end_matches('%').parse::<f64>();
    match (number(shown), number(said)) {
        (Ok(a), Ok(b)) => {
            let least = if shown.contains('.') { 0.02 } else { COUNTS };
            (a - b).abs() <= least || (a / b > 1.0 / DRIFT && a / b < DRIFT)
        }
        _ => shown == said,
    }
}

/// A place for what the commands of all pages write, and what each has printed: many pages show the same command.
struct Terminal {
    place: TempDir,
    printed: HashMap<Vec<String>, String>,
}

impl Terminal {
    fn run(&mut self, command: &[String]) -> &str {
        if !self.printed.contains_key(command) {
            let out = self.run_anew(command);
            self.printed.insert(command.to_vec(), out);
        }
        &self.printed[command]
    }

    fn run_anew(&self, command: &[String]) -> String {
        let in_place = |word: &String| match word {
            ours if ours.starts_with("data/") || ours.starts_with("docs/") => project().join(ours),
            file if file.ends_with(".toml") || file.ends_with(".svg") => {
                self.place.path().join(file)
            }
            other => other.into(),
        };
        let words: Vec<PathBuf> = command.iter().map(in_place).collect();
        let words: Vec<&str> = words
            .iter()
            .map(|word| word.to_str().expect("text"))
            .collect();
        let said = lab(&words);
        assert_eq!(said.code, 0, "{command:?}: {}", said.err);
        said.out
    }
}

#[test]
fn the_pages_show_what_the_tool_prints() {
    let mut terminal = Terminal {
        place: no_boards(),
        printed: HashMap::new(),
    };
    for page in pages() {
        for Shown { command, lines } in shown(&fs::read_to_string(&page).expect("a page")) {
            let out = terminal.run(&command);
            let mut printed = out.lines();
            for line in lines {
                assert!(
                    printed.any(|said| alike(&line, said)),
                    "{}: `host-tool {}` does not print, or not in this place:\n{line}\nbut\n{out}",
                    page.display(),
                    command.join(" "),
                );
            }
        }
    }
    let commands = terminal.printed.len();
    assert!(commands >= 15, "{commands} commands");
}

#[test]
fn lines_are_alike_where_their_words_are() {
    assert!(alike("error 0.521 um rms  ▆▅", "error 0.530 um rms  ▅"));
    assert!(!alike("error 0.521 um rms", "error 0.121 um rms"));
    assert!(!alike("Missing: creep", "Missing: hysteresis"));
}

#[test]
fn blocks_with_a_board_are_left_to_the_emulator() {
    let page =
        "A\n\n    host-tool off\n    host-tool> off\n\nB\n\n    host-tool list\n\n    none\n";
    let shown = shown(page);
    assert_eq!(shown.len(), 1);
    assert_eq!(
        (&shown[0].command[..], &shown[0].lines[..]),
        (&["list".to_owned()][..], &["none".to_owned()][..])
    );
}
