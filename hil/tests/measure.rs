//! The paper's experiments as commands: their files are read again, and nothing is left driven.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::Child;
use std::thread;
use std::time::Duration;

use emulated_board::Speed;
use hil::{Bench, Said, interrupt};
use measurement::MeasurementFile;
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, tcgetattr};

#[test]
fn a_sweep_goes_up_and_down_and_ends_off() {
    let bench = Bench::new();
    let words = [
        "measure", "sweep", "--steps", "5", "--dwell", "50ms", "--rest", "0s",
    ];
    let report = bench.json(&words);
    assert_eq!(report["dropped_samples"], 0);
    assert_eq!(report["measured"][0]["rows"], 11);
    assert!(bench.is_off());
    let file = bench.measured("sweep.csv");
    let volts: Vec<i64> = file
        .rows
        .iter()
        .map(|row| (row.voltage_v[3] * 1e3).round() as i64)
        .collect();
    assert_eq!(
        volts,
        [0, 700, 1400, 2100, 2800, 3500, 2800, 2100, 1400, 700, 0]
    );
    assert!(file.has_current());
    assert!(file.rows.iter().all(|row| row.t_global_s.is_some()));
    let gaps = file.rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    assert!(gaps.into_iter().all(|gap| (gap - 0.05).abs() < 1e-9));

    let said = bench.tool(&words);
    assert_ne!(said.code, 0);
    assert!(
        said.sentence().contains("sweep.csv already exists"),
        "{}",
        said.err
    );
}

#[test]
fn a_step_is_read_densely_after_both_edges() {
    let bench = Bench::new();
    bench.json(&[
        "measure", "step", "--hold", "500ms", "--rest", "0s", "--rate", "10kHz",
    ]);
    let file = bench.measured("step.csv");
    for edge in [0.0, 0.5] {
        let dense = file
            .rows
            .iter()
            .filter(|row| row.t_s > edge && row.t_s < edge + 2.05e-3)
            .count();
        assert_eq!(dense, 20, "after {edge} s");
    }
    assert!(file.rows.len() < 400, "{} rows", file.rows.len());
    assert!(bench.is_off());
}

#[test]
fn a_sine_says_so_and_has_a_hundred_rows_a_cycle() {
    let bench = Bench::new();
    bench.json(&[
        "measure",
        "sine",
        "--frequency",
        "20Hz",
        "--cycles",
        "2",
        "--rest",
        "0s",
        "-o",
        "a.csv",
    ]);
    let file = bench.measured("a.csv");
    assert!(file.keys.drive_is_interpolated());
    assert_eq!(file.keys.prehold().map(|(volts, _)| volts), Some(1.0));
    assert_eq!(file.rows.len(), 200);
    for row in &file.rows {
        // Two of the drive's steps of 1 mV.
        let sine = 1.0 + 0.5 * (std::f64::consts::TAU * 20.0 * row.t_s).sin();
        assert!(
            (row.voltage_v[0] - sine).abs() < 2e-3,
            "{} for {sine}",
            row.voltage_v[0]
        );
    }
    assert!(bench.is_off());
}

#[test]
fn single_actuators_are_driven_alone_and_rest_in_between() {
    let bench = Bench::new();
    bench.json(&[
        "measure", "single", "--steps", "2", "--dwell", "50ms", "--rest", "0s",
    ]);
    let file = bench.measured("single.csv");
    assert_eq!(file.rows.len(), 12);
    for (index, row) in file.rows.iter().enumerate() {
        for other in (0..4).filter(|other| *other != index / 3) {
            assert!((row.voltage_v[other] - 0.2).abs() < 1e-6);
        }
    }
    let global = |index: usize| file.rows[index].t_global_s.unwrap();
    // After every step the experiment waits until the mirror is cold again.
    assert!(global(3) - global(2) > 2.0, "a rest");
    assert!((file.rows[3].t_s - file.rows[2].t_s - 0.05).abs() < 1e-9);
}

#[test]
fn a_sensor_of_ones_own_is_merged_by_time() {
    let bench = Bench::new();
    let recording: String = (-10..40)
        .map(|i| format!("{},{}\n", 0.05 * f64::from(i), i))
        .collect();
    std::fs::write(bench.directory().join("laser.csv"), recording).unwrap();
    bench.json(&[
        "measure",
        "held",
        "1V",
        "2V",
        "--dwell",
        "500ms",
        "--rest",
        "0s",
        "--sensor",
        "laser.csv",
    ]);
    let file = bench.measured("held.csv");
    // 20 micrometres a second.
    for row in &file.rows {
        assert!((row.z_um.unwrap() - 20.0 * row.t_s).abs() < 1e-6);
    }
}

#[test]
fn a_recording_that_is_not_there_yet_is_told_at_once_and_read_at_the_end() {
    // As fast as a real one, or the measurement is over before a busy machine comes to writing the recording.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Times(1.0));
    let held = ["measure", "held", "1V", "2V", "--dwell", "2s"];
    let words = [&held[..], &["--rest", "0s", "--sensor", "laser.csv"]].concat();
    let mut tool = bench.start_tool(&words);
    let mut said = BufReader::new(tool.stderr.take().expect("it is piped")).lines();
    let first = said.next().expect("a line").expect("text");
    assert!(first.contains("laser.csv is not there yet"), "{first}");
    std::fs::write(bench.directory().join("laser.csv"), "-10,-200\n10,200\n").expect("written");
    let later: Vec<String> = said.map_while(Result::ok).collect();
    let ended = tool.wait().expect("it ends");
    assert!(ended.success(), "{later:?}");
    for row in &bench.measured("held.csv").rows {
        // 20 micrometres a second.
        let z_um = row.z_um.expect("it was read");
        assert!((z_um - 20.0 * row.t_s).abs() < 1e-6, "{row:?}");
    }
}

#[test]
fn ctrl_c_leaves_the_channels_off_and_what_was_measured() {
    // As fast as a real one, or the 72 s of the sweep are over before a busy machine comes to interrupting it.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Times(1.0));
    let tool = bench.start_tool(&[
        "measure", "sweep", "--dwell", "1s", "--rest", "0s", "-o", "part.csv", "--json",
    ]);
    // Two rows, of none and a tenth of a volt, do not count as driven: both are read when this is.
    bench.wait_until_driven(5000);
    interrupt(&tool);
    let said = Said::from(tool);
    // 128 and the signal's number.
    assert_eq!(said.code, 130, "{}", said.err);
    assert!(said.out.contains("\"interrupted\":true"), "{}", said.out);
    assert!(bench.is_off());
    let file = bench.measured("part.csv");
    assert_eq!(file.keys.get("partial"), Some("interrupted"));
    assert!(
        (2..71).contains(&file.rows.len()),
        "{} rows",
        file.rows.len()
    );
}

/// A serial sensor: a pseudo terminal's end, and the name of the other one.
fn pseudo_terminal() -> (File, String) {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)
        .expect("a pseudo terminal");
    unlockpt(&ours).expect("it is ours");
    let name = ptsname(&ours, Vec::new()).expect("it has a name");
    (File::from(ours), name.into_string().expect("text"))
}

/// Sends `line` again and again until the tool has ended, once it has opened the device: it drops what came before.
fn send(mut sensor: File, mut tool: Child, line: &str) -> Said {
    let is_open = || {
        let modes = tcgetattr(&sensor).expect("a terminal").local_modes;
        !modes.contains(LocalModes::ICANON)
    };
    while !is_open() && tool.try_wait().expect("it is ours").is_none() {
        thread::sleep(Duration::from_millis(1));
    }
    while tool.try_wait().expect("it is ours").is_none() {
        sensor.write_all(line.as_bytes()).expect("it is read");
        thread::sleep(Duration::from_millis(1));
    }
    Said::from(tool)
}

/// Held voltages, read by this sensor.
fn held_by(sensor: &str) -> Vec<&str> {
    let held = ["measure", "held", "1V", "2V", "--dwell", "50ms"];
    [&held[..], &["--rest", "0s", "--sensor", sensor]].concat()
}

#[test]
fn a_recording_that_cannot_be_read_is_refused_before_anything_is_driven() {
    let bench = Bench::new();
    for (lines, told) in [
        ("0,1\n0.1,x\n0.2,1\n", "line 2, `0.1,x`"),
        ("t,z\n0,1\nt,z\n0.1,1\n", "line 3, `t,z`"),
        ("0,1\n0.1,1\n0.05,1\n", "line 3, `0.05,1`, is not later"),
    ] {
        std::fs::write(bench.directory().join("laser.csv"), lines).expect("written");
        let said = bench.tool(&held_by("laser.csv"));
        assert_eq!(said.code, 1, "{lines}: {said:?}");
        assert!(said.sentence().contains(told), "{}", said.err);
        assert!(!bench.directory().join("held.csv").exists(), "{lines}");
    }
}

/// What the board's own sensor reads is of another place.
#[test]
fn a_sensor_that_fails_in_the_end_leaves_rows_without_displacements() {
    let bench = Bench::new();
    let mut tool = bench.start_tool(&held_by("laser.csv"));
    let mut said = BufReader::new(tool.stderr.take().expect("it is piped")).lines();
    let first = said.next().expect("a line").expect("text");
    assert!(first.contains("laser.csv is not there yet"), "{first}");
    std::fs::write(bench.directory().join("laser.csv"), "0,1\n0.1;1;1\n").expect("written");
    said.for_each(drop);
    assert_eq!(Said::from(tool).code, 1);
    let file = bench.measured("held.csv");
    let partial = file.keys.get("partial").expect("it says so");
    assert!(partial.contains("laser.csv"), "{partial}");
    assert!(file.rows.iter().all(|row| row.z_um.is_none()));
    assert!(file.rows.len() > 1, "currents are kept");
}

#[test]
fn a_serial_sensor_that_sends_more_than_a_number_is_told_what_is_expected() {
    let bench = Bench::new();
    for (line, said_of_it) in [
        ("0.5,12.3\n", Some("but `0.5,12.3`")),
        ("12,3\n", Some("a line such as 12.345 is expected")),
        ("12.3 um\n", None),
    ] {
        let (sensor, name) = pseudo_terminal();
        let tool = bench.start_tool(&held_by(&name));
        let said = send(sensor, tool, line);
        match said_of_it {
            Some(told) => {
                assert_eq!(said.code, 1, "{line}: {said:?}");
                assert!(said.sentence().contains(told), "{}", said.err);
                assert!(!bench.directory().join("held.csv").exists(), "{line}");
            }
            None => assert_eq!(said.code, 0, "{line}: {said:?}"),
        }
    }
}

#[test]
fn a_serial_sensor_that_sends_no_number_is_named() {
    let bench = Bench::new();
    let (sensor, name) = pseudo_terminal();
    let tool = bench.start_tool(&held_by(&name));
    let said = send(sensor, tool, "laser off\n");
    assert_ne!(said.code, 0);
    assert!(
        said.sentence().contains("it sent no number"),
        "{}",
        said.err
    );
    assert!(said.sentence().contains(&name), "{}", said.err);
    assert!(bench.is_off());
}

#[test]
fn a_recording_has_where_the_mirror_was_asked_to_be() {
    let bench = Bench::new();
    bench.json(&["set-z", "50um", "--settle", "100ms"]);
    bench.json(&["record", "-o", "asked.csv", "--duration", "20ms"]);
    let file = bench.measured("asked.csv");
    // The board computes in 32 bits: 50 um to 4e-6.
    let is_asked = |um: Option<f64>| um.is_some_and(|um| (um - 50.0).abs() < 1e-4);
    assert!(file.rows.iter().all(|row| is_asked(row.asked_um)));
    // Where it is, until it is calibrated, is another matter.
    assert!(!file.rows.iter().any(|row| is_asked(row.z_um)));
    bench.json(&["off"]);
}

#[test]
fn a_recording_has_how_far_the_mirror_may_be_from_there() {
    // As fast as a real one: it tells this calibration from its own mirror's, with a wider interval, before a busy machine comes to recording.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Times(1.0));
    // One that says what it leaves.
    let calibration = include_str!("mirror-77.toml");
    std::fs::write(bench.directory().join("calibration.toml"), calibration).expect("written");
    bench.json(&["load-calibration", "calibration.toml"]);
    let moved = bench.json(&["set-z", "50um", "--settle", "500ms", "--hold", "10s"]);
    let told_um = moved["uncertainty"]["z_um"].as_f64().expect("a number");
    bench.json(&["record", "-o", "interval.csv", "--duration", "20ms"]);
    let file = bench.measured("interval.csv");
    let um: Vec<f64> = file
        .rows
        .iter()
        .filter_map(|row| row.uncertainty_um)
        .collect();
    assert!(!um.is_empty());
    // It shrinks with what creeps yet: by some percent in the second between the two.
    let is_told = |um: &f64| (um / told_um - 1.0).abs() < 0.2;
    assert!(um.iter().all(is_told), "{um:?} after {told_um} um");
    bench.json(&["off"]);
}

#[test]
fn a_scan_beyond_the_bandwidth_is_told_before_it_is_driven() {
    let bench = Bench::new();
    let scan = |frequency, cycles, level: &[&str]| {
        let words = ["scan", "sine", "--frequency", frequency, "--cycles", cycles];
        let to = ["-o", "scan.csv", "--force", "--json"];
        bench.tool(&[&words[..], &to, level].concat())
    };
    let warning = "beyond the mirror's bandwidth";
    let slow = scan("20Hz", "3", &[]);
    assert_eq!(slow.code, 0, "{}", slow.err);
    assert!(!slow.err.contains(warning), "{}", slow.err);
    let report: serde_json::Value = serde_json::from_str(&slow.out).expect("JSON");
    assert_eq!(report["limited_by"], serde_json::json!([]));

    let fast = scan("2kHz", "400", &[]);
    assert!(fast.err.contains(warning), "{}", fast.err);
    let span = |um: &[f64]| {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let range = |[low, high]: [f64; 2], um: &f64| [low.min(*um), high.max(*um)];
        let [low, high] = um.iter().fold(none, range);
        high - low
    };
    let report: serde_json::Value = serde_json::from_str(&fast.out).expect("JSON");
    assert_eq!(report["limited_by"], serde_json::json!(["bandwidth"]));
    let ends = report["expected_um"].as_array().expect("two ends").iter();
    let expected_um = span(
        &ends
            .filter_map(serde_json::Value::as_f64)
            .collect::<Vec<_>>(),
    );
    // By its end the first step has faded.
    let rows = bench.measured("scan.csv").rows;
    let reached: Vec<f64> = rows[3 * rows.len() / 4..]
        .iter()
        .filter_map(|row| row.z_um)
        .collect();
    let reached_um = span(&reached);
    // The factory knows no resonance and takes the lowest of such mirrors, 500 Hz; this one has 1450 Hz, and rings.
    assert!(
        (0.5..2.0).contains(&(expected_um / reached_um)),
        "{expected_um} expected, {reached_um} um reached"
    );
    // What is told leaves the first step out, too; a mirror that drifts on by a half of what it moves would be another.
    let told = report["following"]["reached_um"].as_array();
    let told_um = span(
        &told
            .expect("two ends")
            .iter()
            .filter_map(serde_json::Value::as_f64)
            .collect::<Vec<_>>(),
    );
    assert!(
        (1.0..1.5).contains(&(told_um / reached_um)),
        "{told_um} um told, {reached_um} um reached"
    );
    let said = bench.tool(&["scan", "sine", "--frequency", "2kHz", "--cycles", "400"]);
    assert!(said.out.contains("by the mirror's bandwidth"), "{said:?}");
    assert!(!scan("2kHz", "40", &["-q"]).err.contains(warning));
}

#[test]
fn a_recording_goes_to_the_standard_output_and_ends_quietly_with_its_reader() {
    let bench = Bench::new();
    let words = [
        "record",
        "-o",
        "-",
        "--duration",
        "300ms",
        "--period",
        "10ms",
    ];
    let said = bench.tool(&words);
    assert_eq!(said.code, 0, "{}", said.err);
    let file = MeasurementFile::parse("-", &said.out).expect("a measurement file and no more");
    assert_eq!(file.rows.len(), 30);
    assert_eq!(file.keys.get("partial"), None);
    assert!(said.err.contains("30 samples"), "{}", said.err);

    let mut endless = bench.start_tool(&["record", "-o", "-", "--duration", "10h"]);
    let mut first = String::new();
    let mut reader = BufReader::new(endless.stdout.take().expect("it is piped"));
    reader.read_line(&mut first).expect("text");
    drop(reader);
    let said = Said::from(endless);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    assert!(first.starts_with('#'), "{first}");

    let twice = bench.tool(&["record", "-o", "-", "--json"]);
    assert_eq!(twice.code, 1);
    assert!(
        twice.sentence().contains("leave one of them out"),
        "{}",
        twice.err
    );
}
