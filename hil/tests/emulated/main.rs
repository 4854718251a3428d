//! What can only be tried on an emulated board: a virtual mirror behind it, and a link and an
//! emulator that misbehave.

use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use control_core::{Limit, Limits};
use emulated_board::{EmulatedBoard, PlantFault, Speed};
use hil::{Bench, RawLink, Said};
use mirror_protocol::{
    Drives, PROTOCOL_VERSION, Position, Refusal, SetDriveEndpoint, SetPositionEndpoint,
    StatusEndpoint, Stream, StreamEndpoint, WireError,
};
use virtual_mirror::MirrorConfig;

fn bench() -> Bench {
    Bench::emulated(MirrorConfig::bench())
}

fn raw(bench: &Bench) -> RawLink {
    RawLink::connect(&PathBuf::from(bench.board())).expect("the board listens")
}

#[test]
fn a_virtual_mirror_moves_to_where_it_is_asked_by_and_large() {
    let bench = bench();
    for z_um in [40.0, 120.0] {
        let report = bench.json(&["set-z", &format!("{z_um}um"), "--settle", "2s"]);
        let sensor_um = report["sensor_z_um"].as_f64().expect("a virtual sensor");
        let error_um = report["error_um"].as_f64().expect("an error");
        assert_eq!(report["sensor_is_virtual"], true);
        assert!((sensor_um - z_um - error_um).abs() < 1e-9);
        // The factory's model is not this mirror's; calibration is what makes it small.
        assert!(error_um.abs() < 30.0, "{report}");
    }
}

#[test]
fn what_is_printed_names_each_number() {
    let said = bench().tool(&["set-z", "120 µm", "--settle", "100ms"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let names: Vec<&str> = said.out.lines().map(|line| line[..10].trim_end()).collect();
    assert_eq!(
        names,
        [
            "asked",
            "uncertain",
            "drives",
            "currents",
            "temp. rise",
            "limited",
            "moved to",
            "held for"
        ]
    );
    assert!(
        said.out.contains("by the virtual sensor after 0."),
        "{}",
        said.out
    );
}

#[test]
fn the_board_limits_what_a_careless_tool_asks() {
    let bench = bench();
    let mut link = raw(&bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let limits = |reply: Result<mirror_protocol::CommandReply, WireError>| {
        Limits::from_bits(reply.expect("understood").expect("carried out").limits)
    };
    let position = |z_um| Position {
        z_um,
        lease_ms: 1000,
    };
    let high = link.ask::<SetPositionEndpoint>(&position(1e6)).unwrap();
    assert!(limits(high).contains(Limit::PositionHigh));
    let low = link.ask::<SetPositionEndpoint>(&position(-1.0)).unwrap();
    assert!(limits(low).contains(Limit::PositionLow));
    let drives = Drives {
        drive_v: [9.0, 1.0, 1.0, 1.0],
        lease_ms: 1000,
    };
    let reply = link.ask::<SetDriveEndpoint>(&drives).unwrap();
    let driven = reply.as_ref().unwrap().as_ref().unwrap().drive_v;
    assert_eq!(
        driven.map(|drive| (drive * 1e3).round()),
        [3500.0, 1000.0, 1000.0, 1000.0]
    );
    assert!(limits(reply).contains(Limit::DriveHigh));
    let nan = link
        .ask::<SetPositionEndpoint>(&position(f32::NAN))
        .unwrap();
    assert_eq!(nan.unwrap(), Err(Refusal::NotANumber));
}

#[test]
fn the_board_refuses_other_protocol_versions() {
    let bench = bench();
    let mut link = raw(&bench);
    let command = Position {
        z_um: 50.0,
        lease_ms: 1000,
    };
    let without_hello = link.ask::<SetPositionEndpoint>(&command).unwrap();
    assert_eq!(without_hello.unwrap(), Err(Refusal::NoHello));

    let identity = link.greet(PROTOCOL_VERSION + 7).unwrap().unwrap();
    assert_eq!(identity.protocol_version, PROTOCOL_VERSION);
    let refused = link.ask::<SetPositionEndpoint>(&command).unwrap();
    let versions = Refusal::ProtocolVersion {
        board: PROTOCOL_VERSION,
        tool: PROTOCOL_VERSION + 7,
    };
    assert_eq!(refused.unwrap(), Err(versions));

    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    assert!(
        link.ask::<SetPositionEndpoint>(&command)
            .unwrap()
            .unwrap()
            .is_ok()
    );
}

#[test]
fn disturbed_bytes_do_not_stop_the_next_good_request() {
    let bench = bench();
    let mut link = raw(&bench);
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let mut seed = 11_u32;
    let mut random = |length: usize| -> Vec<u8> {
        let mut byte = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        };
        (0..length).map(|_| byte()).collect()
    };
    for round in 0..30 {
        let mut good = link.request::<SetPositionEndpoint>(&Position {
            z_um: 10.0,
            lease_ms: 1000,
        });
        match round % 3 {
            // Truncated: the rest never comes, and the next frame's delimiter ends it.
            0 => good.truncate(good.len() / 2),
            1 => {
                let middle = good.len() / 2;
                good[middle] ^= 0x5a;
            }
            _ => good = random(40 * (round + 1)),
        }
        link.send_bytes(&good).unwrap();
        link.send_bytes(&[0]).unwrap();
        let status = link
            .ask::<StatusEndpoint>(&())
            .expect("the next good request is answered");
        assert!(status.expect("understood").is_ok(), "round {round}");
    }
}

#[test]
fn a_killed_emulator_is_told_and_the_next_command_works() {
    let mut bench = bench();
    let waiting = bench.start_tool(&["set-z", "100um", "--settle", "1h"]);
    bench.wait_until_driven(1);
    bench
        .emulated_board()
        .expect("emulated")
        .kill()
        .expect("it dies");
    let said = Said::from(waiting);
    assert_eq!(said.code, 1);
    assert!(
        said.err.contains("the connection to the board was lost"),
        "{}",
        said.err
    );

    let after = bench.tool(&["status"]);
    assert_eq!(after.code, 1);
    assert!(after.err.contains("cannot be opened"), "{}", after.err);

    let fresh = self::bench();
    assert_eq!(fresh.tool(&["set-z", "100um", "--settle", "1ms"]).code, 0);
}

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

/// Ticks of drive after which a tool that renews its leases of 100 ms has done so many times.
const LEASED_TICKS: u64 = 10_000;
/// A lease of 100 ms and, where its tool dies between two messages, the last one's way through the link.
const LEASE_TICKS: u64 = 1100;
/// From 5 V, more than any drive, to zero by 4 mV a tick (`protection`).
const RAMP_TICKS: u64 = 1250;

#[test]
fn a_tool_that_is_killed_while_it_drives_leaves_no_drive_behind() {
    let mut bench = bench();
    // It drives under leases of 100 ms, which it renews.
    let mut measuring = bench.start_tool(&[
        "measure", "sine", "--mean", "2V", "--cycles", "100000", "--rest", "0s",
    ]);
    bench.wait_until_driven(LEASED_TICKS);
    measuring.kill().expect("it dies");
    measuring.wait().expect("it is gone");
    let driven_ticks = |bench: &mut Bench| {
        let board = bench.emulated_board().expect("emulated");
        board.controls().observed().driven_ticks
    };
    let until_it_is_gone = driven_ticks(&mut bench);
    // The board waits 3 s of real time for the host that has gone, and then ramps.
    let status = bench.wait_for_status("ramped to zero", |status| status["states"][0] == "ready");
    assert_eq!(status["drive_v"], serde_json::json!([0.0, 0.0, 0.0, 0.0]));
    assert_eq!(status["limited_by"], serde_json::json!(["lease-lapsed"]));
    assert_eq!(status["lease"], serde_json::Value::Null);
    let afterwards = driven_ticks(&mut bench) - until_it_is_gone;
    assert!(
        afterwards <= LEASE_TICKS + RAMP_TICKS,
        "it is driven for {afterwards} ticks more"
    );
}

#[test]
fn what_is_held_is_held_so_long_and_no_longer() {
    let bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let status = bench.json(&["status"]);
    assert_eq!(status["lease"], "forever");
    assert_eq!(status["states"][2], "driving");
    bench.json(&["set-z", "50um", "--settle", "10ms", "--hold", "2s"]);
    let held = bench.json(&["status"]);
    let left = held["lease"]["seconds"].as_f64().expect("a number");
    // The hold begins once it has settled, 10 ms, and been read: 100 samples at 1 ms, and as long again for the link.
    assert!((0.0..=2.21).contains(&left), "{held}");
    let status = bench.wait_for_status("released", |status| {
        assert!(
            status["lease"].is_null() || status["states"][0] == "driving",
            "{status}"
        );
        status["lease"].is_null()
    });
    assert_eq!(status["limited_by"], serde_json::json!(["lease-lapsed"]));
}

/// Longer than any time-out that a board could have by the wall's clock.
const STARVED: Duration = Duration::from_secs(6);

/// Has a board that drives go through `trouble`, and expects it to drive on as if nothing had been.
fn goes_on_through(trouble: impl FnOnce(&EmulatedBoard)) {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let before = bench.json(&["status"]);
    let board = bench.emulated_board().expect("emulated");
    trouble(board);
    let later_s = board.simulated_s() + 0.2;
    bench.wait_until_s(later_s);
    let after = bench.json(&["status"]);
    assert_eq!(
        after["states"],
        serde_json::json!(vec!["driving"; 4]),
        "{after}"
    );
    assert_eq!(after["drive_v"], before["drive_v"], "{after}");
    assert_eq!(after["missed_ticks"], 0, "{after}");
    let up_s = |status: &serde_json::Value| status["up_s"].as_f64().expect("a number");
    assert!(up_s(&after) > up_s(&before), "it was not reset: {after}");
}

#[test]
fn a_board_without_a_processor_for_a_while_goes_on() {
    goes_on_through(|board| {
        board.pause().expect("it runs");
        thread::sleep(STARVED);
        board.resume().expect("it is there");
    });
}

#[test]
fn a_board_whose_plant_is_kept_from_answering_goes_on() {
    goes_on_through(|board| board.controls().inject(Some(PlantFault::Stall)));
}

#[test]
fn an_answer_that_nobody_asked_for_is_passed_over() {
    goes_on_through(|board| board.controls().inject(Some(PlantFault::StaleAnswer)));
}

/// Four times as long as the emulated board's watchdog waits from one look to the next (`src/board/mps2/watchdog.rs`).
const SEVERAL_LOOKS: Duration = Duration::from_secs(1);

#[test]
fn a_board_that_hangs_is_reset_and_can_be_cleared() {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
    let board = bench.emulated_board().expect("emulated");
    // A machine without a processor to spare must not wear the watchdog out.
    board.pause().expect("it runs");
    thread::sleep(SEVERAL_LOOKS);
    board.resume().expect("it is there");
    let before_s = board.simulated_s();
    board.controls().inject(Some(PlantFault::Hang));
    // It has started anew, and checked its heaters.
    bench.wait_until_s(before_s + 0.5);
    let status = bench.json(&["status"]);
    assert_eq!(status["drive_v"], serde_json::json!([0.0, 0.0, 0.0, 0.0]));
    assert!(status.to_string().contains("watchdog-reset"), "{status}");
    bench.json(&["clear"]);
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
    let status = bench.json(&["status"]);
    assert_eq!(status["missed_ticks"], 0, "{status}");
}

/// How far an idle board may be ahead of the wall's clock, and how far it may have come between two looks at it.
const AHEAD_S: f64 = 0.02;
/// A board goes so much faster at least on a loaded machine (`README.md`), in one of many pieces of this length.
const FASTER: f64 = 1.3;
const PIECE_S: f64 = 0.2;

#[test]
fn the_clock_of_an_idle_board_goes_with_the_walls_and_faster_while_a_tool_waits() {
    let mut bench = Bench::changed(|emulation| emulation.speed = Speed::Awaited);
    let wall_s = |bench: &mut Bench, simulated_s: f64| {
        let board = bench.emulated_board().expect("emulated");
        let (start, from_s) = (Instant::now(), board.simulated_s());
        bench.wait_until_s(from_s + simulated_s);
        start.elapsed().as_secs_f64()
    };
    let idle_s = wall_s(&mut bench, 2.0);
    assert!(idle_s > 2.0 - AHEAD_S, "{idle_s}");

    let link = raw(&bench);
    let is_faster = |bench: &mut Bench| wall_s(bench, PIECE_S) * FASTER < PIECE_S;
    assert!((0..500).any(|_| is_faster(&mut bench)), "a tool waits");
    drop(link);
    // A look for a tool is up to 50 ms old.
    wall_s(&mut bench, 1.0);
    let idle_s = wall_s(&mut bench, 2.0);
    assert!(idle_s > 2.0 - AHEAD_S, "{idle_s}");
}
