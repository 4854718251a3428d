//! What people type wrongly, and boards that are not there or not well: one clear sentence each,
//! what to do next, a code other than 0, and nothing written.

mod boards;
#[path = "../common/mod.rs"]
mod common;
mod completion;
#[path = "../fake_board/mod.rs"]
mod fake_board;
#[path = "../common/interrupt.rs"]
mod interrupt;

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use common::{Said, host_tool, no_boards};
use fake_board::{Fake, fake_board};
use interrupt::interrupt;
use mirror_protocol::PROTOCOL_VERSION;

fn fails_with(said: &Said, sentence: &str, advice: &str) {
    let err = said.sentence();
    assert_ne!(said.code, 0);
    assert!(err.contains(sentence), "`{sentence}` is not in: {err}");
    assert!(err.contains(advice), "`{advice}` is not in: {err}");
    assert!(said.out.is_empty(), "{}", said.out);
    assert!(!err.contains("╰─▶"), "a cause is told twice: {err}");
    assert!(
        !err.contains("panicked") && !err.contains("stack backtrace"),
        "{err}"
    );
}

#[test]
fn quantities_that_are_none() {
    let boards = no_boards();
    for (word, sentence) in [
        ("quickly", "`quickly` does not start with a number"),
        ("120", "`120` has no unit"),
        ("NaN", "`NaN` does not start with a number"),
        ("inf um", "`inf um` does not start with a number"),
        ("1e999um", "`1e999um` is not a position that can be used"),
        ("1.9V", "`V` is not a unit of a position"),
        ("", "`` does not start with a number"),
        ("--settle=1000000h", "is not a time span up to 100 h"),
    ] {
        let said = host_tool(boards.path(), &["set-z", word]);
        fails_with(&said, sentence, "For more information, try '--help'");
    }
    fails_with(
        &host_tool(boards.path(), &["set-drive", "1.9um"]),
        "`um` is not a unit of a voltage; use one of V, v, mV, uV",
        "--help",
    );
}

/// As people write them, and as the terminal of an emulated board takes them.
#[test]
fn a_unit_may_stand_apart_from_its_number() {
    let boards = no_boards();
    for line in [
        "set-z 120 um --hold 2 s",
        "set-drive 1 V 2 V 1.5 V 0 V",
        "set-pose 60 um 0.5 deg -0.3 deg",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        fails_with(
            &host_tool(boards.path(), &words),
            "no board was found",
            "connect",
        );
    }
}

/// What is driven while the mirror settles counts as well: a tool that is killed meanwhile leaves the mirror driven for both.
#[test]
fn no_lease_is_longer_than_the_bench_allows() {
    let boards = no_boards();
    let asked = |words: &str| {
        let words: Vec<&str> = words.split(' ').collect();
        host_tool(boards.path(), &words)
    };
    for move_ in ["set-z 50um", "set-drive 1V", "set-pose 50um 0deg 0deg"] {
        for (spans, sentence, advice) in [
            (
                "--hold 5s --settle 2h",
                "settling for 7200 s and then holding for 5 s drives the board for longer than this bench allows, 10 s",
                "shorter --settle",
            ),
            (
                "--settle 2h",
                "drives the board for longer than this bench allows, 10 s",
                "shorter --settle",
            ),
            (
                "--hold 11s",
                "a hold of 11 s is longer than this bench allows, 10 s",
                "shorter --hold",
            ),
            (
                "--hold forever",
                "is longer than this bench allows",
                "shorter --hold",
            ),
        ] {
            fails_with(
                &asked(&format!("{move_} --longest-hold 10s {spans}")),
                sentence,
                advice,
            );
        }
        // A hold is as long as it may be, and who has named it is told.
        for (spans, told) in [
            ("--longest-hold 10s", ""),
            ("--longest-hold 10s --hold 8s", ""),
            (
                "--longest-hold 10s --hold 8s --settle 4s",
                "held for 5.8 s in place of 8 s",
            ),
            ("", ""),
        ] {
            let said = asked(format!("{move_} {spans}").trim_end());
            fails_with(&said, "no board was found", told);
        }
    }
    for poses in [
        "calibrate-pose c.toml --settle 2h --longest-hold 1h",
        "calibrate-room c.toml r.toml --settle 2h --longest-hold 1h",
    ] {
        fails_with(
            &asked(poses),
            "drives the board for longer than this bench allows, 3600 s",
            "shorter --settle",
        );
    }
}

#[test]
fn help_for_a_name_that_is_mistyped_names_its_neighbour() {
    let boards = no_boards();
    for (words, neighbour) in [
        (["help", "moniter"].as_slice(), "'monitor'"),
        (&["help", "measure", "sesion"], "'session'"),
    ] {
        let said = host_tool(boards.path(), words);
        assert_eq!(said.code, 2, "{words:?}");
        assert!(said.sentence().contains(neighbour), "{}", said.err);
    }
    let said = host_tool(boards.path(), &["help", "set-z"]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert_eq!(said.out, host_tool(boards.path(), &["set-z", "--help"]).out);
}

#[test]
fn counts_that_are_none() {
    let boards = no_boards();
    for (count, told) in [
        ("-1", "`-1` is no whole number from 1 to 1000000"),
        ("0", "`0` is no whole number from 1 to 1000000"),
        ("2.5", "`2.5` is no whole number"),
        ("many", "`many` is no whole number"),
    ] {
        let words = ["scan", "sine", "--frequency", "5Hz", "--cycles", count];
        fails_with(&host_tool(boards.path(), &words), told, "--help");
    }
}

#[test]
fn what_would_measure_nothing() {
    let boards = no_boards();
    for words in [
        &["record", "-o", "a.csv", "--duration", "0s"][..],
        &["measure", "sweep", "--max", "0V"],
        &["measure", "single", "--max", "0V"],
    ] {
        let said = host_tool(boards.path(), words);
        fails_with(&said, "is none, and nothing would be measured", "--help");
    }
}

#[test]
fn a_hold_that_is_longer_than_the_bench_allows() {
    let boards = no_boards();
    for (hold, command) in [
        ("forever", "set-z"),
        ("11min", "set-z"),
        ("forever", "set-drive"),
    ] {
        let to = if command == "set-z" { "10um" } else { "1V" };
        let words = [command, to, "--hold", hold, "--longest-hold", "10min"];
        fails_with(
            &host_tool(boards.path(), &words),
            "is longer than this bench allows, 600 s",
            "MIRROR_LONGEST_HOLD",
        );
    }
    // What is allowed fails for want of a board only.
    let words = [
        "set-z",
        "10um",
        "--hold",
        "10min",
        "--longest-hold",
        "10min",
    ];
    fails_with(&host_tool(boards.path(), &words), "no board was found", "");
}

#[test]
fn a_name_that_no_calibration_holds() {
    let boards = no_boards();
    fake_board(boards.path(), "fake", Fake::Greets(PROTOCOL_VERSION));
    for name in [&"x".repeat(49), "", " ", "a\nb"] {
        let said = host_tool(boards.path(), &["calibrate", "--device", name]);
        fails_with(
            &said,
            "is no name for a calibration, which holds one of up to 48 bytes",
            "choose another name",
        );
    }
}

#[test]
fn a_plane_of_nothing() {
    let boards = no_boards();
    let said = host_tool(boards.path(), &["measure", "plane"]);
    fails_with(&said, "<VOLTS>...", "--help");
    let said = host_tool(
        boards.path(),
        &["measure", "plane", "1V", "--from", "scan.xyz"],
    );
    fails_with(&said, "cannot be used with", "--help");
    let said = host_tool(boards.path(), &["measure", "plane", "--from", "scan.xyz"]);
    fails_with(&said, "scan.xyz' cannot be read", "is the name right");
}

#[test]
fn five_drives() {
    let boards = no_boards();
    for count in [2, 3, 5] {
        let words = [&["set-drive"][..], &vec!["1.9V"; count]].concat();
        fails_with(
            &host_tool(boards.path(), &words),
            &format!("a mirror has four actuators, and {count} voltages were given"),
            "one voltage for all four actuators, or one for each",
        );
    }
}

#[test]
fn what_is_said_beside_the_report_is_as_much_as_one_asks_for() {
    let boards = no_boards();
    fake_board(boards.path(), "fake", Fake::HangsUp);
    let asked = "mirror/hello: ";
    let said = host_tool(boards.path(), &["status", "-v"]);
    assert!(said.err.contains(asked), "{}", said.err);
    assert!(!host_tool(boards.path(), &["status"]).err.contains(asked));
    // A failure is said in any case.
    let said = host_tool(boards.path(), &["status", "-q"]);
    assert!(
        said.err.contains("connection to the board was lost"),
        "{}",
        said.err
    );

    let file = |name: &str| boards.path().join(name).to_string_lossy().into_owned();
    let new = |name: &str, level: &[&str]| {
        let file = file(name);
        let words = [&["effect", "new", "-o", &file][..], level].concat();
        host_tool(boards.path(), &words)
    };
    assert!(new("usual.toml", &[]).err.contains("written to"));
    let said = new("quiet.toml", &["--quiet"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    assert_eq!(new("both.toml", &["-q", "-v"]).code, 2);
}

#[test]
fn a_move_that_is_interrupted_before_it_is_answered_says_that_the_board_may_be_driven() {
    for words in [&["set-z", "60um"][..], &["set-drive", "1V"]] {
        let boards = no_boards();
        fake_board(boards.path(), "fake", Fake::Deaf);
        let mut tool = Command::new(env!("CARGO_BIN_EXE_host-tool"))
            .args(words)
            .args(["--hold", "60s"])
            .env("MIRROR_BOARDS", boards.path())
            .env_remove("MIRROR_BOARD")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the tool runs");
        while !boards.path().join("fake.asked").exists() {
            let ended = tool.try_wait().expect("it is ours");
            assert_eq!(ended, None, "it asks before it ends");
            thread::sleep(Duration::from_millis(1));
        }
        interrupt(&tool);
        let said = tool.wait_with_output().expect("it ends");
        // A shell says 130 of it.
        assert_eq!(said.status.code(), Some(130), "{words:?}: {said:?}");
        let told = String::from_utf8_lossy(&said.stderr);
        let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in ["before the board answered", "62 s", "host-tool off"] {
            assert!(told.contains(word), "{words:?}: {told}");
        }
    }
}

#[test]
fn an_output_file_that_cannot_be_written() {
    let boards = no_boards();
    fails_with(
        &host_tool(boards.path(), &["record", "-o", "/no/such/place/a.csv"]),
        "/no/such/place/a.csv cannot be written: No such file or directory (os error 2) help: choose",
        "choose a file in a directory that exists",
    );
    fails_with(
        &host_tool(boards.path(), &["effect", "new", "-o", "a.toml/"]),
        "a.toml/ cannot be written: not a directory",
        "choose a file in a directory that exists",
    );
    fails_with(
        &host_tool(
            boards.path(),
            &["record", "--force", "-o", &boards.path().to_string_lossy()],
        ),
        "is there and is not a file",
        "choose the name of a file",
    );
    let existing = boards.path().join("kept.csv");
    fs::write(&existing, "kept").expect("a file");
    fails_with(
        &host_tool(
            boards.path(),
            &["record", "-o", &existing.to_string_lossy()],
        ),
        "already exists",
        "replace it with --force",
    );
    let said = host_tool(
        boards.path(),
        &["record", "--force", "-o", &existing.to_string_lossy()],
    );
    fails_with(&said, "no board was found", "connect");
    assert_eq!(
        fs::read_to_string(&existing).expect("it is still there"),
        "kept"
    );
}

#[test]
fn a_recording_that_does_not_begin_leaves_no_file() {
    let boards = no_boards();
    let path = boards.path().join("none.csv");
    let words = ["record", "-o", &path.to_string_lossy()];
    fails_with(
        &host_tool(boards.path(), &words),
        "no board was found",
        "connect",
    );
    assert!(!path.exists());
    fake_board(boards.path(), "leaving", Fake::HangsUp);
    fails_with(
        &host_tool(boards.path(), &words),
        "lost while asking it",
        "unplugged",
    );
    assert!(!path.exists());
}

#[test]
fn one_voltage_makes_no_measurement() {
    let boards = no_boards();
    fails_with(
        &host_tool(boards.path(), &["measure", "held", "1V"]),
        "only 1 was provided",
        "--help",
    );
}

#[test]
fn an_address_that_cannot_be_listened_on_is_told_with_its_remedy() {
    let boards = no_boards();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let taken = taken.local_addr().expect("bound").to_string();
    for (address, advice) in [
        (taken.as_str(), "port 0 is any that is free"),
        // Of the block that is for documentation (RFC 5737).
        ("192.0.2.1:0", "this machine has no such address"),
        ("5025", "--listen 127.0.0.1:5025"),
    ] {
        let said = host_tool(boards.path(), &["serve", "--listen", address]);
        let sentence = format!("`{address}` cannot be listened on");
        fails_with(&said, &sentence, advice);
    }
}
