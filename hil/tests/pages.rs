//! What the README and the pages of `docs` type on an emulated board is typed, and what they show of its answers is printed: the
//! words and the whole numbers. Other numbers are those of the tick in which a command arrived.

#[path = "../../host-tool/tests/lab/shown.rs"]
mod shown;

use std::fs;

use hil::Bench;
use virtual_mirror::MirrorConfig;

use shown::{alike, blocks, pages};

/// What stands before a command in the terminal of a board, and before one that has a board of its own.
const PROMPT: &str = "host-tool> ";
const ALONE: &str = "cargo xtask emulate -- ";
/// Commands that go on until they are ended, and those that take minutes of the board's time; other tests run them.
const LEFT_OUT: [&str; 8] = [
    "calibrate",
    "calibrate-room",
    "calibrate-sense",
    "diagnose",
    "measure",
    "monitor",
    "report",
    "serve",
];
/// What stands for lines that are left out.
const CUT: &str = "...";
/// How the emulator ends its own report, which is not the tool's.
const EMULATOR: &str = "Emulated ";

/// A command that a page types, and the lines that it shows of its answer.
struct Typed {
    command: String,
    is_alone: bool,
    lines: Vec<String>,
}

/// The command of a line, if it has one, and nothing else yet.
fn command(line: &str) -> Option<Typed> {
    let alone = line.strip_prefix(ALONE);
    let command = alone.or_else(|| line.strip_prefix(PROMPT))?;
    Some(Typed {
        command: command.to_owned(),
        is_alone: alone.is_some(),
        lines: Vec::new(),
    })
}

fn typed(page: &str) -> Vec<Typed> {
    let mut all: Vec<Typed> = Vec::new();
    for block in blocks(page) {
        if command(block[0].1).is_none() {
            continue;
        }
        for (_, line) in block {
            match command(line) {
                Some(command) => all.push(command),
                None if line == CUT || line.starts_with(EMULATOR) => {}
                None => all
                    .last_mut()
                    .expect("the block begins with one")
                    .lines
                    .push(line.to_owned()),
            }
        }
    }
    let is_short = |typed: &Typed| {
        let word = typed.command.split(' ').next();
        !word.is_some_and(|word| LEFT_OUT.contains(&word))
    };
    all.retain(is_short);
    all
}

/// A line without what names the build and its protocol.
fn of_any_build(line: &str) -> &str {
    match line.split_once(", protocol ") {
        Some((_, of_all)) => of_all.trim_start_matches(|c: char| c.is_ascii_digit()),
        None => line,
    }
}

#[test]
fn the_pages_show_what_a_board_answers() {
    let (mut count, mut wrong) = (0, Vec::new());
    for path in pages() {
        let commands = typed(&fs::read_to_string(&path).expect("a page"));
        if commands.is_empty() {
            continue;
        }
        let bench = Bench::emulated(MirrorConfig::bench());
        for Typed {
            command,
            is_alone,
            lines,
        } in commands
        {
            let words: Vec<&str> = command.split(' ').collect();
            let said = match is_alone {
                true => Bench::emulated(MirrorConfig::bench()).tool(&words),
                false => bench.tool(&words),
            };
            let out = said.out.clone() + &said.err;
            // 1 is what the board refuses, as a page may show; 2 is what the tool does not understand.
            assert_ne!(said.code, 2, "{}: {command}: {out}", path.display());
            let mut printed = out.lines();
            for line in lines {
                let same = |shown: &str, said: &str| shown.contains('.') || shown == said;
                if !printed.any(|said| alike(of_any_build(&line), of_any_build(said), same)) {
                    wrong.push(format!("{}: {command}\n{line}\nbut\n{out}", path.display()));
                    break;
                }
            }
            count += 1;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 10, "{count} commands");
}
