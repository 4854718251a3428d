//! `off` gets through to an emulated board whoever has it, and says who that was.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::Instant;

use hil::{Bench, RawLink, Said};
use mirror_protocol::{
    Drives, LEASE_FOREVER_MS, PROTOCOL_VERSION, Refusal, SetDriveEndpoint, Stream, StreamEndpoint,
};
use serde_json::{Value, json};
use virtual_mirror::MirrorConfig;

const OFF: [f64; 4] = [0.0; 4];
/// Who goes on driving has driven by then: ten leases of 100 ms.
const AFTERWARDS_S: f64 = 1.0;

fn bench() -> Bench {
    Bench::emulated(MirrorConfig::bench())
}

fn raw(bench: &Bench) -> RawLink {
    RawLink::connect(&PathBuf::from(bench.board())).expect("the board listens")
}

/// `off` as JSON, and how long it took, for the report.
fn off(bench: &Bench, whose: &str) -> Value {
    let start = Instant::now();
    let report = bench.json(&["off"]);
    println!("off while {whose}: {:.2} s", start.elapsed().as_secs_f64());
    assert_eq!(report["drive_v"], json!(OFF));
    report
}

/// The board is not driven any more, now and later.
fn assert_stays_off(bench: &mut Bench) {
    let board = bench.emulated_board().expect("emulated");
    let (driven_ticks, now_s) = (
        board.controls().observed().driven_ticks,
        board.simulated_s(),
    );
    bench.wait_until_s(now_s + AFTERWARDS_S);
    let board = bench.emulated_board().expect("emulated");
    assert_eq!(board.controls().observed().driven_ticks, driven_ticks);
}

fn signal(process: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([name, &process.id().to_string()])
        .status();
    assert!(sent.expect("`kill` runs").success(), "it has ended");
}

fn drives(drive_v: f32) -> Drives {
    Drives {
        drive_v: [drive_v; 4],
        lease_ms: LEASE_FOREVER_MS,
    }
}

#[test]
fn a_measurement_is_stopped_and_does_not_drive_again() {
    let mut bench = bench();
    let measuring = bench.start_tool(&[
        "measure", "sine", "--mean", "2V", "--cycles", "100000", "--rest", "0s",
    ]);
    bench.wait_until_driven(1000);
    let report = off(&bench, "a measurement drives");
    assert_eq!(report["owner"]["process"], measuring.id());
    let command = report["owner"]["command"].as_str().expect("a command");
    assert!(command.starts_with("host-tool measure sine"), "{command}");
    assert_stays_off(&mut bench);
    let said = Said::from(measuring);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    assert!(
        sentence.contains("turned off by `host-tool off`"),
        "{sentence}"
    );
    assert!(bench.is_off());
}

/// Whoever moved the mirror is told at once, long before it would have settled, and not what was read of a mirror that rests.
#[test]
fn a_move_ends_with_the_stop_and_says_so() {
    let bench = bench();
    for words in [
        &["set-z", "100um"][..],
        &["set-drive", "2V"],
        &["set-pose", "100um", "0deg", "0deg"],
        &["set-z", "100um", "--hold", "forever", "--json"],
    ] {
        let moving = bench.start_tool(&[words, &["--settle", "90h"]].concat());
        bench.wait_for_status("driven", |status| {
            status["owner"]["process"] == moving.id() && status["states"][0] == "driving"
        });
        off(&bench, words[0]);
        let said = Said::from(moving);
        assert_eq!(said.code, 1, "{words:?}: {said:?}");
        let sentence = said.sentence();
        assert!(
            sentence.contains("turned off by `host-tool off`"),
            "{words:?}: {sentence}"
        );
        match words.contains(&"--json") {
            true => {
                let failed: Value = serde_json::from_str(&said.out).expect("JSON");
                assert_eq!(failed["error"]["code"], "turned-off", "{failed}");
            }
            false => assert_eq!(said.out, "", "{words:?}"),
        }
    }
}

/// How far an emulated board is by then depends on the machine; what is told is of a mirror that is held, or says that it is not any more.
#[test]
fn a_hold_that_is_over_before_the_mirror_is_read_is_told() {
    let bench = bench();
    for hold in ["0s", "50ms", "200ms", "10min"] {
        let said = bench.tool(&["set-z", "50um", "--hold", hold, "--json"]);
        let told: Value = serde_json::from_str(&said.out).expect("JSON");
        match said.code {
            0 => {
                // Of 50 um, and a board as delivered is off by a tenth.
                let error_um = told["error_um"].as_f64().expect("read");
                assert!(error_um.abs() < 10.0, "{hold}: {told}");
            }
            _ => {
                assert_eq!(told["error"]["code"], "held-too-shortly", "{hold}: {told}");
                let help = told["error"]["help"].as_str().expect("text");
                assert!(help.ends_with("--hold 10s"), "{hold}: {help}");
                assert_ne!(hold, "10min");
            }
        }
    }
}

#[test]
fn a_tool_that_hangs_while_it_records_does_not_keep_the_board_from_stopping() {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let words = [
        "record",
        "-o",
        "long.csv",
        "--duration",
        "10h",
        "--period",
        "100us",
    ];
    let mut recording = bench.start_tool(&words);
    let lock = bench.directory().join("emulated.lock");
    let id = recording.id().to_string();
    bench.wait("it does not get the board", |_| {
        fs::read_to_string(&lock).is_ok_and(|owner| owner.contains(&id))
    });
    signal(&recording, "-STOP");
    let report = off(&bench, "a recording hangs");
    assert_eq!(report["owner"]["process"], recording.id());
    recording.kill().expect("it dies");
    recording.wait().expect("it is gone");
    assert_stays_off(&mut bench);
}

#[test]
fn a_silent_client_on_the_socket_does_not_keep_the_board_from_stopping() {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let silent = raw(&bench);
    let report = off(&bench, "a silent client is connected");
    assert_eq!(report["owner"], Value::Null);
    assert_stays_off(&mut bench);
    drop(silent);
    assert!(bench.is_off());
}

#[test]
fn a_client_that_fetches_nothing_does_not_keep_the_board_from_stopping() {
    let mut bench = bench();
    let mut link = raw(&bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let driven = link.ask::<SetDriveEndpoint>(&drives(2.0)).unwrap().unwrap();
    driven.expect("it drives");
    let stream = Stream {
        period_ticks: 1,
        count: u32::MAX,
        ..Stream::default()
    };
    let request = link.request::<StreamEndpoint>(&stream);
    link.send_bytes(&request).expect("it is sent");
    // Its time stands still once the socket is full of samples.
    wait_until_time_stands(&bench);
    off(&bench, "a client fetches no samples");
    drop(link);
    assert!(bench.is_off());
    assert_stays_off(&mut bench);
}

/// So many looks at a board, a millisecond apart, find its time where it was only if it stands: a tick takes some 20 us.
const LOOKS: u32 = 200;

fn wait_until_time_stands(bench: &Bench) {
    let (mut last_s, mut same) = (0.0, 0);
    bench.wait("its time goes on without the client", |board| {
        let now_s = board.simulated_s();
        same = if now_s == last_s { same + 1 } else { 0 };
        last_s = now_s;
        same == LOOKS
    });
}

#[test]
fn who_greets_anew_drives_and_who_does_not_is_refused() {
    let bench = bench();
    let mut link = raw(&bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let drive = |link: &mut RawLink| link.ask::<SetDriveEndpoint>(&drives(1.0)).unwrap().unwrap();
    drive(&mut link).expect("it drives");
    for _ in 0..3 {
        off(&bench, "a client drives");
        assert_eq!(drive(&mut link), Err(Refusal::NoHello));
        link.greet(PROTOCOL_VERSION).unwrap().unwrap();
        drive(&mut link).expect("it drives");
    }
}

#[test]
fn many_at_once_all_stop() {
    let mut bench = bench();
    let mut link = raw(&bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let driven = link.ask::<SetDriveEndpoint>(&drives(1.0)).unwrap().unwrap();
    driven.expect("it drives");
    let offs: Vec<Child> = (0..8).map(|_| bench.start_tool(&["off"])).collect();
    for off in offs {
        let said = Said::from(off);
        assert_eq!(said.code, 0, "{}", said.err);
    }
    assert_stays_off(&mut bench);
}

#[test]
fn the_ways_to_a_board_are_one_board_and_lead_nowhere_once_it_is_gone() {
    let mut bench = bench();
    let list = bench.json(&["list"]);
    let boards = list["boards"].as_array().expect("a list");
    let names: Vec<&Value> = boards.iter().map(|board| &board["name"]).collect();
    assert_eq!(names, ["emulated"]);
    bench.kill_board();
    let said = bench.tool(&["off"]);
    assert_eq!(said.code, 1);
    assert!(said.sentence().contains("cannot be opened"), "{}", said.err);
}
