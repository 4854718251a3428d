//! What can only be tried on an emulated board: a virtual mirror behind it, and a link and an
//! emulator that misbehave.

mod recordings;
mod trouble;

use std::path::PathBuf;
use std::time::Instant;

use control_core::{Limit, Limits};
use emulated_board::Speed;
use hil::{Bench, RawLink, Said};
use mirror_protocol::{
    Drives, PROTOCOL_VERSION, Position, Refusal, SetDriveEndpoint, SetPositionEndpoint,
    StatusEndpoint, WireError,
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
    bench.kill_board();
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
    // A status between two ticks may have the last step of the ramp yet.
    let status = bench.wait_for_status("ramped to zero", |status| {
        status["states"][0] == "ready"
            && status["drive_v"] == serde_json::json!([0.0, 0.0, 0.0, 0.0])
    });
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
