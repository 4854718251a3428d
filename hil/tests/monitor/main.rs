//! The live view in a pseudo terminal, in front of an emulated board: keys drive the mirror, and however the view ends,
//! the board and the terminal are left as they were.

use std::net::UdpSocket;
use std::num::NonZero;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use emulated_board::{EmulatedBoard, Speed};
use hil::{Bench, Terminal, interrupt};
use serde_json::{Value, json};

/// The arrow up, as terminals send it.
const UP: &str = "\x1b[A";
/// How often the terminal is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// A board with the wall's clock, for somebody looks at it.
fn bench() -> Bench {
    Bench::changed(|emulation| emulation.speed = Speed::Times(1.0))
}

/// A view that drives the mirror to 60 um. Where this machine stood still for longer than the lease, it is asked once more,
/// as whoever sits before it would.
fn driving(bench: &Bench) -> Terminal {
    let mut terminal = Terminal::start(bench, &["monitor"]);
    terminal.wait_for(bench, "not driven");
    terminal.types("60\r");
    terminal.wait_for(bench, "asked 60.000 um, pose 60.000 ±");
    bench.wait("it does not drive", |_| {
        let text = terminal.text();
        if text.contains("lease-lapsed") && text.contains("all ready") {
            terminal.types("60\r");
        }
        sleep(LOOK);
        text.contains("all driving")
    });
    terminal
}

#[test]
fn keys_move_the_mirror_and_q_turns_it_off() {
    let bench = bench();
    let mut terminal = driving(&bench);
    assert!(!terminal.is_restored(), "it has the terminal to itself");
    assert!(
        terminal.text().contains("driven from here"),
        "{}",
        terminal.text()
    );
    terminal.types(UP);
    terminal.wait_for(&bench, "asked 61.000 um, pose 61.000 ±");
    terminal.types("\x1b[1;2B-1\r");
    terminal.wait_for(&bench, "asked 50.000 um, pose 50.000 ±");
    terminal.types("300\r");
    terminal.wait_for(&bench, "300 um is beyond the range");
    terminal.types("q");
    assert_eq!(terminal.wait(), Some(0));
    terminal.wait_for(&bench, "outputs    channels are off");
    assert!(terminal.is_restored(), "{}", terminal.text());
    assert!(bench.is_off());
}

#[test]
fn what_is_recorded_is_a_measurement_file_and_none_is_written_over() {
    let bench = bench();
    let mut terminal = driving(&bench);
    for name in ["monitor.csv", "monitor-2.csv"] {
        terminal.types("r");
        terminal.wait_for(&bench, "REC ");
        let now_s = bench.simulated_s();
        bench.wait_until_s(now_s + 0.5);
        terminal.types("r");
        terminal.wait_for(&bench, &format!("recorded in {name}"));
        let file = bench.measured(name);
        assert!(file.rows.len() > 10, "{} rows", file.rows.len());
        let steps = file.rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
        assert!(
            steps.clone().all(|step| (step - 0.01).abs() < 1e-9),
            "10 ms apart"
        );
        assert_eq!(file.keys.get("experiment"), Some("record"));
        // Where the machine stood still the lease has lapsed, and the view says so.
        let has_lapsed = terminal.text().contains("lease-lapsed");
        assert!(
            has_lapsed || file.rows[0].voltage_v[0] > 0.5,
            "it is driven"
        );
    }
}

#[test]
fn a_view_that_is_killed_leaves_no_drive_behind() {
    let bench = bench();
    let mut terminal = driving(&bench);
    terminal.tool.kill().expect("it runs");
    assert_eq!(terminal.wait(), None);
    let status = bench.wait_for_status("ramped to zero", |status| status["states"][0] == "ready");
    assert_eq!(status["drive_v"], json!([0.0, 0.0, 0.0, 0.0]));
    assert_eq!(status["limited_by"], json!(["lease-lapsed"]));
}

#[test]
fn a_terminal_that_stands_still_leaves_no_drive_behind() {
    let bench = bench();
    let terminal = driving(&bench);
    terminal.stands_still();
    bench.wait("the board drives on, and nobody sees it", |bench| {
        bench.controls().observed().came_to_zero
    });
}

#[test]
fn signals_end_it_with_the_channels_off_and_the_terminal_restored() {
    let bench = bench();
    let mut terminal = driving(&bench);
    interrupt(&terminal.tool);
    // 128 and the signal's number.
    assert_eq!(terminal.wait(), Some(130));
    terminal.wait_for(&bench, "channels are off");
    assert!(terminal.is_restored() && bench.is_off());

    for (signal, code) in [("-TERM", 143), ("-HUP", 129)] {
        let mut terminal = driving(&bench);
        let id = terminal.tool.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status();
        assert!(sent.expect("`kill` runs").success());
        assert_eq!(terminal.wait(), Some(code), "{signal}");
        terminal.wait_for(&bench, "channels are off");
        assert!(terminal.is_restored(), "{}", terminal.text());
        assert!(bench.is_off(), "{signal}");
    }

    let mut terminal = driving(&bench);
    terminal.types("\x03");
    assert_eq!(terminal.wait(), Some(130));
    terminal.wait_for(&bench, "channels are off");
    assert!(terminal.is_restored() && bench.is_off());
}

#[test]
fn a_terminal_that_is_closed_ends_it_with_the_channels_off() {
    let bench = bench();
    let mut terminal = driving(&bench);
    terminal.close();
    let code = terminal.wait();
    // It hears the signal of the terminal's end, or cannot draw on it, whichever is first.
    assert!(matches!(code, Some(1 | 129)), "{code:?}");
    assert!(bench.is_off());
}

#[test]
fn a_stop_turns_off_and_what_was_asked_before_it_does_not_drive_after_it() {
    let bench = bench();
    let mut terminal = driving(&bench);
    terminal.types(&format!("{UP}{UP}{UP}{UP} "));
    terminal.wait_for(&bench, "stopped: channels are off");
    terminal.wait_for(&bench, "not driven");
    terminal.wait_for(&bench, "all ready");
    // Its own stop needs no more than the next key.
    terminal.types(UP);
    terminal.wait_for(&bench, "all driving");
    terminal.types("0");
    terminal.wait_for(&bench, "stopped: channels are off");

    terminal.types("40\r");
    terminal.wait_for(&bench, "asked 40.000 um");
    bench.json(&["off"]);
    terminal.wait_for(&bench, "turned off by another tool");
    terminal.types(UP);
    terminal.wait_for(&bench, "not driven");
    terminal.types("c");
    terminal.wait_for(&bench, "cleared");
    terminal.types("40\r");
    terminal.wait_for(&bench, "asked 40.000 um, pose 40.000 ±");
}

#[test]
fn any_size_is_shown_and_what_this_view_did_not_drive_goes_on() {
    let bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let mut terminal = Terminal::start(&bench, &["monitor"]);
    terminal.wait_for(&bench, "driven by an earlier command");
    for size in [[20, 10], [1, 1], [40, 12], [200, 60]] {
        let [columns, rows] = size.map(|size| NonZero::new(size).expect("not zero"));
        terminal.resize(columns, rows);
        let least = if columns.get() > 1 { "emulated" } else { "e" };
        terminal.wait_for(&bench, least);
    }
    terminal.wait_for(&bench, "drives         2.000 V");
    terminal.types("q");
    assert_eq!(terminal.wait(), Some(0));
    terminal.wait_for(&bench, "this drove nothing");
    assert!(terminal.is_restored());
    let status = bench.json(&["status"]);
    assert_eq!(status["states"][0], "driving", "{status}");
}

/// A board as it is unplugged and plugged in again.
#[test]
fn a_board_that_is_gone_is_told_and_shown_again_when_it_is_back() {
    let mut emulation = None;
    let mut bench = Bench::changed(|new| {
        new.speed = Speed::Times(1.0);
        emulation = Some(new.clone());
    });
    let mut terminal = driving(&bench);
    terminal.types("r");
    terminal.wait_for(&bench, "REC ");
    let now_s = bench.simulated_s();
    bench.wait_until_s(now_s + 0.2);
    bench.kill_board();
    for told in [
        "board      gone: it was unplugged",
        "the view goes on by itself",
        "recorded in monitor.csv",
    ] {
        terminal.wait_for(&bench, told);
    }
    let recorded = bench.measured("monitor.csv");
    assert!(
        recorded.keys.get("partial").is_some(),
        "it says why it ends"
    );
    terminal.types(UP);
    terminal.wait_for(&bench, "needs the board");
    assert!(
        !terminal.text().contains("driven from here"),
        "{}",
        terminal.text()
    );

    let again = EmulatedBoard::start(&emulation.expect("it was started"));
    let _again = again.expect("it is there again");
    terminal.wait_for(&bench, "the board is back");
    terminal.wait_for(&bench, "not driven");
    // What was typed meanwhile is not done.
    terminal.wait_for(&bench, "all ready");
    terminal.types("40\r");
    terminal.wait_for(&bench, "asked 40.000 um, pose 40.000 ±");
    terminal.types("q");
    assert_eq!(terminal.wait(), Some(0));
    terminal.wait_for(&bench, "outputs    channels are off");
    assert!(terminal.is_restored(), "{}", terminal.text());
}

#[test]
fn a_view_whose_board_is_gone_can_be_left() {
    let mut bench = bench();
    let mut terminal = driving(&bench);
    bench.kill_board();
    terminal.wait_for(&bench, "gone: it was unplugged");
    terminal.types("q");
    assert_eq!(terminal.wait(), Some(0));
    terminal.wait_for(&bench, "outputs    the board is gone");
    assert!(terminal.is_restored(), "{}", terminal.text());
}

#[test]
fn without_a_terminal_it_says_what_there_is_instead() {
    let bench = bench();
    let said = bench.tool(&["monitor"]);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    for word in ["needs a terminal", "host-tool status", "host-tool record"] {
        assert!(sentence.contains(word), "{sentence}");
    }
    let missing = bench.tool(&["monitor", "--plotjuggler", "nowhere"]);
    assert_eq!(missing.code, 1);
}

#[test]
fn samples_go_to_plotjuggler_as_they_come() {
    let bench = bench();
    let server = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let address = server.local_addr().expect("it has one").to_string();
    let mut terminal = Terminal::start(&bench, &["monitor", "--plotjuggler", &address]);
    terminal.wait_for(&bench, "not driven");
    terminal.types("50\r");
    let mut last_s = 0.0;
    let mut bytes = [0; 2000];
    let is_there = |told: &Value| told["mirror"]["pose_z_um"] == json!(50.0);
    loop {
        let length = server.recv(&mut bytes).expect("a datagram");
        let told: Value = serde_json::from_slice(&bytes[..length]).expect("JSON");
        let now_s = told["timestamp"].as_f64().expect("a number");
        assert!(now_s > last_s, "{told}");
        last_s = now_s;
        if is_there(&told) {
            assert!(
                told["mirror"]["V1_V"].as_f64().expect("a number") > 0.5,
                "{told}"
            );
            break;
        }
    }
    terminal.types("q");
    assert_eq!(terminal.wait(), Some(0));
}
