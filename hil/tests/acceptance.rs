//! What any driver board must do, asked through the tool as a user does.

use std::time::{Duration, Instant};

use hil::Bench;
use host_tool::board::{Board, RENEWED_LEASE_MS, choose};
use mirror_protocol::Drives;
use serde_json::Value;

fn four(report: &Value, field: &str) -> [f64; 4] {
    std::array::from_fn(|i| report[field][i].as_f64().unwrap_or(f64::NAN))
}

#[test]
fn the_board_introduces_itself() {
    let bench = Bench::new();
    let status = bench.json(&["status"]);
    assert_eq!(
        status["identity"]["protocol_version"],
        mirror_protocol::PROTOCOL_VERSION
    );
    assert_eq!(
        status["identity"]["firmware_version"],
        env!("CARGO_PKG_VERSION")
    );
    assert_eq!(status["identity"]["tick_hz"], 10_000);
    // The factory's table and any calibration of a mirror of this kind reach further.
    assert!(status["max_position_um"].as_f64().unwrap() > 100.0);
}

#[test]
fn a_position_takes_drive_current_and_heat_on_every_channel() {
    let bench = Bench::new();
    let report = bench.json(&["set-z", "120um", "--settle", "500ms"]);
    assert_eq!(report["asked_um"], 120.0);
    assert_eq!(report["limited_by"], Value::Array(vec![]));
    // 120 um take 2 V to the board's 3.5 V on a mirror of this kind, through 310 to 450 ohm cold and up to 1.8 times as much
    // hot (`control-core`'s limits), and more than 20 K at 1.1 to 1.6 um a kelvin.
    for channel in 0..4 {
        let (drive_v, current_a) = (
            four(&report, "drive_v")[channel],
            four(&report, "current_a")[channel],
        );
        assert!((2.0..3.5).contains(&drive_v), "{report}");
        assert!((250.0..800.0).contains(&(drive_v / current_a)), "{report}");
        assert!(
            four(&report, "temperature_rise_k")[channel] > 20.0,
            "{report}"
        );
    }
    bench.json(&["off"]);
}

#[test]
fn more_position_takes_more_drive() {
    let bench = Bench::new();
    let drive = |z: &str| four(&bench.json(&["set-z", z, "--settle", "10ms"]), "drive_v")[0];
    let drives = ["0um", "1um", "20um", "0.1mm", "173um"].map(drive);
    assert_eq!(drives[0], 0.0);
    assert!(drives.is_sorted_by(|a, b| a < b), "{drives:?}");
    bench.json(&["off"]);
}

#[test]
fn the_ends_of_the_range_are_told_and_kept() {
    let bench = Bench::new();
    for (words, sentence) in [
        (
            &["set-z", "300um"][..],
            "300 um is beyond the range of this board, 0 to 173.",
        ),
        (
            &["set-z", "-1um"],
            "-1 um is beyond the range of this board",
        ),
        (
            &["set-drive", "3.6V"],
            "3.6 V is beyond what this board drives, 0 to 3.5 V",
        ),
        (
            &["set-drive", "-0.1V", "--settle", "1s"],
            "-0.1 V is beyond what this board drives",
        ),
    ] {
        let said = bench.tool(words);
        let err = said.sentence();
        assert_ne!(said.code, 0);
        assert!(err.contains(sentence), "{err}");
        assert!(said.out.is_empty());
        assert_eq!(
            four(&bench.json(&["status"]), "drive_v"),
            [0.0; 4],
            "nothing was driven"
        );
    }
}

#[test]
fn each_channel_is_driven_and_sensed_by_itself() {
    let bench = Bench::new();
    for channel in 0..4 {
        let drives: [&str; 4] =
            std::array::from_fn(|other| if other == channel { "1.9V" } else { "0.2V" });
        let words = [&["set-drive"][..], &drives, &["--settle", "200ms"]].concat();
        let report = bench.json(&words);
        for other in 0..4 {
            let current_ma = four(&report, "current_a")[other] * 1e3;
            let expected = if other == channel { 3.0..6.5 } else { 0.3..0.9 };
            assert!(
                expected.contains(&current_ma),
                "channel {other}: {current_ma} mA"
            );
        }
    }
    bench.json(&["off"]);
}

#[test]
fn off_is_off() {
    /// Five times what the amplifier's offset makes of no current (`docs/board.md`): a hundredth of what 2 V drive.
    const OFFSET_A: f64 = 20e-6;
    let bench = Bench::new();
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
    assert_eq!(four(&bench.json(&["off"]), "drive_v"), [0.0; 4]);
    let status = bench.json(&["status"]);
    assert_eq!(four(&status, "drive_v"), [0.0; 4]);
    assert!(
        four(&status, "current_a")
            .iter()
            .all(|current| current.abs() < OFFSET_A),
        "{status}"
    );
}

#[test]
fn a_recording_is_a_measurement_file() {
    let bench = Bench::new();
    bench.json(&["set-drive", "1.5V", "--settle", "10ms"]);
    let report = bench.json(&["record", "-o", "still.csv", "--duration", "200ms"]);
    assert_eq!(report["samples"], 200);
    let file = bench.measured("still.csv");
    assert_eq!(file.rows.len(), 200);
    assert!((file.rows[199].t_s - 0.199).abs() < 1e-9);
    let other = file
        .rows
        .iter()
        .find(|row| (row.voltage_v[0] - 1.5).abs() > 1e-6);
    assert!(other.is_none(), "{other:?}");
    assert!(
        file.rows
            .iter()
            .all(|row| row.current_a[3].is_some_and(|i| i > 2e-3))
    );
    bench.json(&["off"]);
}

/// Requests whose round trips are measured.
const REQUESTS: usize = 500;
/// USB full speed asks once a millisecond, there and back; the rest is for the host.
const LONGEST_MEDIAN: Duration = Duration::from_millis(10);

/// A runtime for conversations with the board that the tool's commands do not have.
fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}

async fn open(bench: &Bench) -> Board {
    let found = choose(Some(bench.board())).expect("it is there");
    Board::open(&found).await.expect("it answers")
}

#[test]
fn every_request_gets_an_answer_of_its_own_and_a_real_board_s_in_time() {
    let bench = Bench::new();
    let (mut trips, ticks): (Vec<Duration>, Vec<u32>) = runtime().block_on(async {
        let board = open(&bench).await;
        let mut answers = Vec::new();
        for _ in 0..REQUESTS {
            let start = Instant::now();
            let status = board.status().await.expect("it answers");
            answers.push((start.elapsed(), status.telemetry.tick));
        }
        answers.into_iter().unzip()
    });
    let total: Duration = trips.iter().sum();
    trips.sort_unstable();
    let median = trips[REQUESTS / 2];
    println!(
        "round trip: median {median:?}, longest {:?}, {:.0} requests a second",
        trips[REQUESTS - 1],
        REQUESTS as f64 / total.as_secs_f64()
    );
    // No answer is an earlier one's: the board has gone on in between.
    assert!(ticks.is_sorted(), "{ticks:?}");
    assert!(ticks[0] < ticks[REQUESTS - 1]);
    // How fast an emulated board's link is depends on the machine: there it is only told.
    if !bench.is_emulated() {
        assert!(median <= LONGEST_MEDIAN, "{median:?}");
    }
}

/// Records 2000 samples, and fails where one of them is missing.
fn record_all(bench: &Bench, period: &str, duration: &str, period_s: f64) {
    let dropped = || bench.json(&["status"])["dropped_samples"].clone();
    let before = dropped();
    let words = [
        "record",
        "-o",
        "long.csv",
        "--duration",
        duration,
        "--period",
        period,
    ];
    assert_eq!(bench.json(&words)["samples"], 2000);
    let file = bench.measured("long.csv");
    let lost = file
        .rows
        .windows(2)
        .filter(|pair| (pair[1].t_s - pair[0].t_s - period_s).abs() > 1e-9)
        .count();
    assert_eq!((file.rows.len(), lost), (2000, 0));
    assert_eq!(dropped(), before);
    println!("2000 samples, one every {period}: none lost");
}

#[test]
fn no_sample_is_lost() {
    record_all(&Bench::new(), "1ms", "2s", 1e-3);
}

/// The longest samples, at the highest rate.
#[test]
fn no_sample_of_any_tick_of_a_driven_board_is_lost() {
    let bench = Bench::new();
    let moved = bench.tool(&["set-z", "60um"]);
    assert_eq!(moved.code, 0, "{}", moved.err);
    record_all(&bench, "0.1ms", "0.2s", 1e-4);
}

#[test]
fn a_host_that_is_lost_leaves_no_drive_behind() {
    let bench = Bench::new();
    runtime().block_on(async {
        let board = open(&bench).await;
        let drives = Drives {
            drive_v: [2.0; 4],
            lease_ms: RENEWED_LEASE_MS,
        };
        let commanded = board.set_drive(drives).await.expect("it drives");
        assert_eq!(
            commanded.drive_v.map(|drive| (drive * 1e3).round()),
            [2000.0; 4]
        );
        // It is gone here, without a word.
    });
    // A channel is ready from the tick on that ends the ramp, in which its last step is still driven.
    let status = bench.wait_for_status("ramped to zero", |status| {
        status["states"][0] == "ready" && four(status, "drive_v") == [0.0; 4]
    });
    assert_eq!(status["limited_by"], serde_json::json!(["lease-lapsed"]));
}
