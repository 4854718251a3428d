//! The README and the pages of `docs`: every command that needs no board is run, and what a page shows of its output is what
//! it prints, digit by digit.
//!
//! `MIRROR_WRITE_PAGES=1 cargo test -p host-tool --test lab readme` writes today's numbers into the pages, where their words
//! are today's already. Look at what it changes.

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use crate::common::no_boards;
use crate::lab;
use crate::shown::{INDENT, alike, blocks, number, pages, project};

/// All of this is computed from files that ship, with seeds that ship: it repeats. Another processor's mathematics may turn
/// the rounding of a number's last printed digit, so it may be off by so many of its units.
const LAST_DIGIT: f64 = 1.0;
/// Writes today's numbers into the pages.
const WRITE: &str = "MIRROR_WRITE_PAGES";

/// Commands with this option search for a formula, a quarter of a minute each: they run where what is long is asked for.
const LONG: &str = "--propose";

/// A command, and the lines that a page shows of its output, each with its number in the page.
struct Shown {
    command: Vec<String>,
    lines: Vec<(usize, String)>,
}

impl Shown {
    fn is_run(&self) -> bool {
        long_runs::are_asked_for() || !self.command.iter().any(|word| word == LONG)
    }
}

/// The commands of a page that need no board, in blocks of such commands only.
fn shown(page: &str) -> Vec<Shown> {
    let needs_a_board =
        |(_, line): &(usize, &str)| line.starts_with("host-tool>") || line.starts_with("cargo ");
    let mut shown: Vec<Shown> = Vec::new();
    for block in blocks(page) {
        if !block[0].1.starts_with("host-tool ") || block.iter().any(needs_a_board) {
            continue;
        }
        for (number, line) in block {
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
                    .push((number, line.into())),
            }
        }
    }
    shown
}

/// Whether two numbers are printed with as many digits, and are the same to the last of them.
fn same_digits(shown: &str, said: &str) -> bool {
    let unit = |word: &str| {
        let (digits, power) = match word.trim_end_matches('%').split_once('e') {
            Some((digits, power)) => (digits, power.parse().unwrap_or(0)),
            None => (word.trim_end_matches('%'), 0),
        };
        let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
        10.0_f64.powi(power - decimals as i32)
    };
    let (Some(a), Some(b)) = (number(shown), number(said)) else {
        return false;
    };
    // Half a unit for the binary numbers that these decimals become.
    unit(shown) == unit(said) && (a - b).abs() <= (LAST_DIGIT + 0.5) * unit(shown) || a == b
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
            file if [".toml", ".svg", ".html"]
                .iter()
                .any(|end| file.ends_with(end)) =>
            {
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
    let writes = std::env::var_os(WRITE).is_some();
    let mut terminal = Terminal {
        place: no_boards(),
        printed: HashMap::new(),
    };
    let mut wrong = Vec::new();
    for path in pages() {
        let page = fs::read_to_string(&path).expect("a page");
        let mut today: Vec<String> = page.lines().map(String::from).collect();
        for Shown { command, lines } in shown(&page).into_iter().filter(Shown::is_run) {
            let out = terminal.run(&command);
            let mut printed = out.lines();
            for (number, line) in lines {
                let is_it = |said: &&str| match writes {
                    true => alike(&line, said, |_, _| true),
                    false => alike(&line, said, same_digits),
                };
                match printed.clone().position(|said| is_it(&said)) {
                    Some(at) => {
                        let said = printed.nth(at).expect("it was found");
                        today[number] = format!("{INDENT}{said}");
                    }
                    None => wrong.push(format!(
                        "{}:{}: `host-tool {}` does not print, or not in this place:\n{line}\nbut\n{out}",
                        path.display(),
                        number + 1,
                        command.join(" "),
                    )),
                }
            }
        }
        if writes {
            fs::write(&path, today.join("\n") + "\n").expect("written");
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let commands = terminal.printed.len();
    assert!(commands >= 15, "{commands} commands");
}

#[test]
fn lines_are_alike_where_words_and_digits_are() {
    let alike = |shown, said| alike(shown, said, same_digits);
    assert!(alike("error 0.521 um rms  ▆▅", "error 0.521 um rms  ▅"));
    assert!(alike("error 0.521 um rms", "error 0.522 um rms"));
    assert!(!alike("error 0.521 um rms", "error 0.523 um rms"));
    assert!(!alike("error 0.521 um rms", "error 0.52 um rms"));
    assert!(alike("share 12%", "share 13%") && !alike("share 12%", "share 14%"));
    assert!(alike("1.2e-3", "1.3e-3") && !alike("1.2e-3", "1.2e-2"));
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
        (&["list".to_owned()][..], &[(9, "none".to_owned())][..])
    );
}
