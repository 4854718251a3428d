//! The README's walk-throughs: every command is run, and what it prints there is what it prints.

use std::fs;
use std::path::Path;

use crate::common::no_boards;
use crate::lab;

/// Where the walk-throughs begin and end in the README.
const BEGIN: &str = "**See where a model is wrong";
const END: &str = "**What a verdict is worth";
/// A README's numbers are those of its day, and today's may be by this factor larger or smaller; the words around them
/// must be today's.
const DRIFT: f64 = 4.0;
/// Whole numbers may be so far off.
const COUNTS: f64 = 2.0;

/// A command, and the lines that the README shows of its output.
struct Shown {
    command: Vec<String>,
    lines: Vec<String>,
}

fn shown() -> Vec<Shown> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = fs::read_to_string(readme).expect("the README");
    let from = readme.find(BEGIN).expect("the walk-throughs begin");
    let to = readme.find(END).expect("they end");
    let mut shown: Vec<Shown> = Vec::new();
    for line in readme[from..to]
        .lines()
        .filter_map(|line| line.strip_prefix("    "))
    {
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

#[test]
fn the_readme_shows_what_the_tool_prints() {
    let place = no_boards();
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let all = shown();
    assert!(all.len() >= 8, "{} commands", all.len());
    for Shown { command, lines } in all {
        let in_place = |word: &String| match word {
            data if data.starts_with("data/") => project.join(data),
            file if file.ends_with(".toml") || file.ends_with(".svg") => place.path().join(file),
            other => other.into(),
        };
        let words: Vec<_> = command.iter().map(in_place).collect();
        let words: Vec<_> = words
            .iter()
            .map(|word| word.to_str().expect("text"))
            .collect();
        let said = lab(&words);
        assert_eq!(said.code, 0, "{command:?}: {}", said.err);
        let mut printed = said.out.lines();
        for line in lines {
            assert!(
                printed.any(|said| alike(&line, said)),
                "`host-tool {}` does not print, or not in this place:\n{line}\nbut\n{}",
                command.join(" "),
                said.out
            );
        }
    }
}

#[test]
fn lines_are_alike_where_their_words_are() {
    assert!(alike("error 0.521 um rms  ▆▅", "error 0.530 um rms  ▅"));
    assert!(!alike("error 0.521 um rms", "error 0.121 um rms"));
    assert!(!alike("Missing: creep", "Missing: hysteresis"));
}
