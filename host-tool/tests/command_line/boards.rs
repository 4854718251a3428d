//! Boards that are not there, not well or not to be trusted.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use mirror_protocol::PROTOCOL_VERSION;

use crate::common::{host_tool, no_boards};
use crate::fails_with;
use crate::fake_board::{Fake, fake_board};

#[test]
fn no_board() {
    let boards = no_boards();
    for words in [&["status"][..], &["list"], &["set-z", "120um"], &["off"]] {
        fails_with(
            &host_tool(boards.path(), words),
            "no board was found",
            "connect a driver board by USB, or try everything without one: `cargo xtask emulate`",
        );
    }
    let said = host_tool(boards.path(), &["list", "--json"]);
    assert_eq!(
        (said.code, said.out.as_str()),
        (0, "{\"format\":1,\"boards\":[]}\n")
    );
}

#[test]
fn two_boards() {
    let boards = no_boards();
    fake_board(boards.path(), "left", Fake::Silent);
    fake_board(boards.path(), "right", Fake::Greets(PROTOCOL_VERSION + 1));
    fails_with(
        &host_tool(boards.path(), &["off"]),
        "there are several boards: left, right",
        "choose one with --board NAME",
    );
    fails_with(
        &host_tool(boards.path(), &["--board", "middle", "off"]),
        "there is no board `middle`; found: left, right",
        "name one of them",
    );
    fails_with(
        &host_tool(boards.path(), &["--board", "rigth", "off"]),
        "there is no board `rigth`; found: left, right; did you mean `right`?",
        "name one of them",
    );
}

#[test]
fn a_socket_that_nobody_listens_on() {
    let boards = no_boards();
    let path = boards.path().join("gone.sock");
    fs::write(&path, "").expect("a file");
    fails_with(
        &host_tool(boards.path(), &["status"]),
        "no board was found",
        "connect",
    );
    fails_with(
        &host_tool(
            boards.path(),
            &["--board", &path.to_string_lossy(), "status"],
        ),
        "cannot be opened: it is no board's socket",
        "is it still there",
    );
    let left = fs::read_dir(boards.path()).expect("a folder").count();
    assert_eq!(left, 1, "it leaves no lock beside what is no board's");
}

#[test]
fn a_board_that_other_users_could_have_put_there_is_not_greeted() {
    let boards = no_boards();
    fake_board(boards.path(), "open", Fake::Greets(PROTOCOL_VERSION));
    let path = boards.path().join("open.sock");
    let set_mode = |path: &Path, mode| {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).expect("ours");
    };
    set_mode(boards.path(), 0o777);
    let by_path = path.to_string_lossy();
    for words in [
        &["status"][..],
        &["list"],
        &["--board", "open", "status"],
        &["--board", &by_path, "status"],
    ] {
        let sentence = format!("other users may write to {}", boards.path().display());
        fails_with(&host_tool(boards.path(), words), &sentence, "`chmod 700`");
    }
    let said = host_tool(boards.path(), &["doctor"]);
    assert!(
        said.out.contains("emulated boards are not looked for"),
        "{}",
        said.out
    );

    set_mode(boards.path(), 0o700);
    set_mode(&path, 0o666);
    let sentence = format!("other users may write to {by_path}");
    fails_with(
        &host_tool(boards.path(), &["status"]),
        &sentence,
        "`chmod 700`",
    );
}

#[test]
fn a_board_of_another_protocol_version() {
    let boards = no_boards();
    fake_board(boards.path(), "newer", Fake::Greets(PROTOCOL_VERSION + 1));
    fake_board(boards.path(), "older", Fake::Greets(PROTOCOL_VERSION - 1));
    fails_with(
        &host_tool(boards.path(), &["--board", "newer", "set-z", "120um"]),
        &format!(
            "the board speaks protocol version {}, this tool version {PROTOCOL_VERSION}",
            PROTOCOL_VERSION + 1
        ),
        "update this tool",
    );
    fails_with(
        &host_tool(boards.path(), &["--board", "older", "set-z", "120um"]),
        &format!("the board speaks protocol version {}", PROTOCOL_VERSION - 1),
        "update the board's firmware: `cargo xtask flash`",
    );
}

#[test]
fn a_board_that_never_answers() {
    let boards = no_boards();
    fake_board(boards.path(), "mute", Fake::Silent);
    fails_with(
        &host_tool(boards.path(), &["status"]),
        "the board did not answer in 10 s when asked to introduce itself",
        "is another program connected to it?",
    );
}

#[test]
fn a_board_that_goes_away() {
    let boards = no_boards();
    fake_board(boards.path(), "leaving", Fake::HangsUp);
    fails_with(
        &host_tool(boards.path(), &["status"]),
        "the connection to the board was lost while asking it to tell its status",
        "it was unplugged, reset, or its emulator ended",
    );
}

#[test]
fn noise_before_an_answer_is_passed_over() {
    let boards = no_boards();
    fake_board(boards.path(), "noisy", Fake::Noisy);
    fails_with(
        &host_tool(boards.path(), &["status"]),
        "lost while asking it to tell its status",
        "it was unplugged",
    );
}
