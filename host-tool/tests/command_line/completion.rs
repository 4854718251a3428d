//! What a shell completes, and whom the script is printed for.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{host_tool, no_boards};
use crate::fake_board::{Fake, fake_board};

#[test]
fn completions_are_for_the_shell() {
    let boards = no_boards();
    let said = host_tool(boards.path(), &["completions", "bash"]);
    assert_eq!(said.code, 0);
    assert!(said.out.contains("complete -o nospace"), "{}", said.out);
}

/// What bash offers after this line, of which the last word is being typed.
fn completed(boards: &Path, line: &str) -> Vec<String> {
    let tool = Path::new(env!("CARGO_BIN_EXE_host-tool"));
    let folder = tool.parent().expect("a folder").to_string_lossy();
    // As bash calls the function that the script registers, with the words of the line.
    let script = format!(
        "PATH={folder}:$PATH; source <(host-tool completions bash)
         complete -p host-tool > /dev/null
         COMP_WORDS=({line}); [[ '{line}' == *' ' ]] && COMP_WORDS+=('')
         COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMP_TYPE=9
         _clap_complete_host_tool host-tool \"${{COMP_WORDS[COMP_CWORD]}}\"; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    );
    let said = Command::new("bash")
        .args(["-c", &script])
        .env("MIRROR_BOARDS", boards)
        .env_remove("MIRROR_BOARD")
        .current_dir(boards)
        .output()
        .expect("bash runs");
    let offered = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(
        said.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&said.stderr)
    );
    offered
        .lines()
        .map(|name| name.trim_end().to_owned())
        .collect()
}

#[test]
fn bash_completes_commands_at_all_levels_and_what_there_is() {
    let boards = no_boards();
    fs::write(boards.path().join("mine.toml"), "").expect("a file");
    fs::write(boards.path().join("mine.csv"), "").expect("a file");
    fake_board(boards.path(), "bench-a", Fake::HangsUp);
    for (line, offered) in [
        ("host-tool set-p", &["set-pose"][..]),
        ("host-tool measure st", &["step"]),
        ("host-tool measure step --ho", &["--hold"]),
        (
            "host-tool explain over-",
            &["over-temperature", "over-current"],
        ),
        ("host-tool effect show cre", &["creep"]),
        ("host-tool effect add mi", &["mine.toml"]),
        ("host-tool compare paper-", &["paper-refit"]),
        ("host-tool --board ben", &["bench-a"]),
    ] {
        let found = completed(boards.path(), line);
        for name in offered {
            assert!(found.iter().any(|one| one == name), "{line}: {found:?}");
        }
        assert!(
            !found.iter().any(|one| one == "mine.csv"),
            "{line}: {found:?}"
        );
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let mut tool = Command::new(env!("CARGO_BIN_EXE_host-tool"))
        .args(["completions", "zsh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the tool runs");
    drop(tool.stdout.take());
    let output = tool.wait_with_output().expect("it ends");
    assert!(output.status.success());
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
