//! Recordings, whatever becomes of the tool and of the board.

use emulated_board::Speed;
use hil::Bench;
use mirror_protocol::{PROTOCOL_VERSION, Stream, StreamEndpoint};

use crate::{bench, raw};

/// Starts a stream of a sample every `period_ticks`, and is gone in the midst of it.
fn stream_and_die(bench: &Bench, period_ticks: u16) {
    let mut link = raw(bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let stream = Stream {
        period_ticks,
        count: u32::MAX,
        ..Stream::default()
    };
    let started = link.ask::<StreamEndpoint>(&stream).unwrap().unwrap();
    started.expect("it streams");
}

#[test]
fn a_tool_that_dies_while_streaming_leaves_the_board_ready() {
    let bench = bench();
    stream_and_die(&bench, 10);
    let said = bench.tool(&["set-z", "50um", "--settle", "1ms"]);
    assert_eq!(said.code, 0, "{}", said.err);
}

#[test]
fn samples_of_a_dead_tool_are_not_taken_for_ones_own() {
    let bench = bench();
    stream_and_die(&bench, 3);
    let words = [
        "record",
        "-o",
        "second.csv",
        "--duration",
        "300ms",
        "--period",
        "10ms",
    ];
    assert_eq!(bench.json(&words)["samples"], 30);
    let file = bench.measured("second.csv");
    let steps = file.rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    assert!(
        steps.clone().all(|step| (step - 0.01).abs() < 1e-9),
        "{:?}",
        steps.collect::<Vec<_>>()
    );
}

#[test]
fn a_recording_whose_tool_is_killed_is_read_for_what_it_has() {
    let bench = bench();
    let words = ["record", "-o", "cut.csv", "--duration", "1000s"];
    let mut recording = bench.start_tool(&words);
    // A second of the board's time, of which half a second at most may be held back.
    let file = bench.directory().join("cut.csv");
    while std::fs::metadata(&file).map_or(0, |file| file.len()) < 50_000 {
        assert_eq!(recording.try_wait().expect("it is asked"), None);
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    recording.kill().expect("it dies");
    recording.wait().expect("it is gone");
    let file = bench.measured("cut.csv");
    let steps = file.rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    assert!(steps.clone().all(|step| (step - 0.001).abs() < 1e-9));
    let told = format!("it was cut short after {} rows", file.rows.len());
    let partial = file.keys.get("partial").unwrap_or_default();
    assert!(partial.starts_with(&told), "{partial}");
    let said = bench.tool(&["compare", "paper", "cut.csv"]).sentence();
    assert!(said.contains(&told), "{said}");
}

#[test]
fn a_recording_is_as_long_as_it_was_asked_to_be_or_refused() {
    let bench = bench();
    let slow = [
        "record",
        "-o",
        "slow.csv",
        "--duration",
        "12s",
        "--period",
        "4s",
    ];
    assert_eq!(bench.json(&slow)["samples"], 3);
    for (period, sentence) in [
        (
            "0s",
            "samples cannot come every 0 s: the board takes 0.0001 s to 6.5535 s",
        ),
        ("10us", "samples cannot come every 1e-5 s"),
        ("10s", "samples cannot come every 10 s"),
        ("0.15ms", "samples cannot come every 0.00015 s"),
    ] {
        let said = bench.tool(&["record", "-o", "never.csv", "--period", period]);
        let err = said.sentence();
        assert_eq!(said.code, 1);
        assert!(err.contains(sentence), "{err}");
        assert!(!bench.directory().join("never.csv").exists());
    }
}

#[test]
fn a_recording_does_not_hold_what_somebody_else_drives() {
    const HOLD_S: f64 = 20.0;
    // Between the two commands no more of the board's time passes than of the wall's.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Awaited);
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "20s"]);
    bench.json(&[
        "record",
        "-o",
        "held.csv",
        "--duration",
        "25s",
        "--period",
        "50ms",
    ]);
    let file = bench.measured("held.csv");
    let driven = file.rows.iter().take_while(|row| row.voltage_v[0] > 0.0);
    let held_s = driven.last().expect("it is driven at first").t_s;
    // The hold begins once it has settled, 10 ms, and been read: 100 samples at 1 ms, and as long again for the link;
    // then the board ramps to zero within 100 ms.
    assert!(held_s <= HOLD_S + 0.31, "{held_s}");
    assert_eq!(file.rows.last().expect("rows").voltage_v, [0.0; 4]);
}
