//! What the shells complete when somebody presses Tab, each in a pseudo terminal, beside an emulated board.

use std::path::PathBuf;
use std::process::Command;
use std::{env, iter};

use hil::{Bench, Terminal};
use virtual_mirror::MirrorConfig;

/// A shell without its user's own settings, and how the tool's completion gets into it.
struct Shell {
    name: &'static str,
    words: &'static [&'static str],
    setup: &'static str,
}

const SHELLS: [Shell; 3] = [
    Shell {
        name: "bash",
        words: &["--norc", "--noprofile", "-i"],
        setup: "source <(host-tool completions bash)",
    },
    Shell {
        name: "zsh",
        words: &["-f", "-i"],
        setup: "autoload -U compinit; compinit -u -D; source <(host-tool completions zsh)",
    },
    Shell {
        name: "fish",
        words: &["--no-config", "-i"],
        setup: "host-tool completions fish | source",
    },
];

/// What is typed before Tab, and what stands there then: commands, options, faults, effects, presets, and the board.
const COMPLETED: [(&str, &str); 6] = [
    ("host-tool set-p", "host-tool set-pose"),
    ("host-tool measure step --ho", "step --hold"),
    ("host-tool explain over-t", "explain over-temperature"),
    ("host-tool effect show cre", "show creep"),
    ("host-tool compare paper-", "compare paper-refit"),
    ("host-tool --board emul", "--board emulated"),
];
/// Takes the line away: Ctrl-U, which waits for its turn among the keys as Ctrl-C does not.
const CTRL_U: &str = "\x15";

#[test]
fn every_shell_completes_what_there_is() {
    let bench = Bench::emulated(MirrorConfig::bench());
    for shell in &SHELLS {
        if !is_installed(shell.name) {
            assert!(
                !long_runs::are_asked_for(),
                "{} is not installed; `cargo xtask test --full` installs it",
                shell.name
            );
            println!(
                "skipped: {} is not installed, so nobody knows what it completes",
                shell.name
            );
            continue;
        }
        let mut terminal = Terminal::start_program(&started(&bench, shell));
        terminal.wait_for_keys(&bench);
        // Typed in two parts, so that the line itself does not show it.
        terminal.types(&format!("{}; echo is-{}\r", shell.setup, "'ready'"));
        terminal.wait_for(&bench, "is-ready");
        for (typed, offered) in COMPLETED {
            terminal.types(&format!("{typed}\t"));
            terminal.wait_for(&bench, offered);
            terminal.types(CTRL_U);
        }
        println!("{}: {} lines completed", shell.name, COMPLETED.len());
    }
}

fn is_installed(shell: &str) -> bool {
    let folders = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&folders).any(|folder| folder.join(shell).is_file())
}

/// The shell, which finds the tool that was built, and the boards of this bench.
fn started(bench: &Bench, shell: &Shell) -> Command {
    let tool = bench.command(&[]);
    let folder = PathBuf::from(tool.get_program());
    let folder = folder.parent().expect("a folder").to_owned();
    let others = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths(iter::once(folder).chain(env::split_paths(&others)));
    let mut command = Command::new(shell.name);
    command
        .args(shell.words)
        .env("PATH", path.expect("folders without a colon"))
        .env("MIRROR_BOARDS", bench.directory())
        .env("HOME", bench.directory())
        .env("TERM", "xterm")
        .current_dir(bench.directory());
    command
}
