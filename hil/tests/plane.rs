//! The plate's two angles, from a scan by a person who moves the sensor's spot from point to point.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStderr, ChildStdin};

use hil::{Bench, Said, interrupt, signal};
use measurement::Session;
use virtual_mirror::{Family, MirrorConfig, VirtualMirror};

/// A plate that tilts.
fn config() -> MirrorConfig {
    MirrorConfig::draw(Family::B, 41)
}

const GRID_UM: [f64; 3] = [-50.0, 0.0, 50.0];

/// A person in front of the tool.
struct Person {
    keys: ChildStdin,
    said: BufReader<ChildStderr>,
    heard: String,
}

impl Person {
    fn at(tool: &mut Child) -> Self {
        Self {
            keys: tool.stdin.take().expect("piped"),
            said: BufReader::new(tool.stderr.take().expect("piped")),
            heard: String::new(),
        }
    }

    /// Wherever the tool asks for the spot it is moved to, and Enter is pressed, until `enough` points are answered or the tool ends.
    fn answer(&mut self, bench: &mut Bench, enough: usize) {
        for _ in 0..enough {
            let mut line = String::new();
            while !line.contains("move the spot to") {
                line.clear();
                if self.said.read_line(&mut line).expect("text") == 0 {
                    return;
                }
                self.heard += &line;
            }
            let number = |after: &str| -> f64 {
                let (_, rest) = line.split_once(after).expect("it is named");
                let word = rest.split_whitespace().next().expect("a number");
                word.parse().expect("a number")
            };
            bench.controls().move_spot([number(" x "), number(" y ")]);
            writeln!(self.keys).expect("it listens");
        }
    }

    /// What the tool has said when it has ended.
    fn hear_the_rest(mut self) -> String {
        self.said.read_to_string(&mut self.heard).expect("text");
        self.heard
    }
}

/// Answers `enough` points; then `stop` ends the tool.
fn scan(bench: &mut Bench, tool: &mut Child, enough: usize, stop: fn(&mut Child)) -> String {
    let mut person = Person::at(tool);
    person.answer(bench, enough);
    stop(tool);
    person.hear_the_rest()
}

fn grid(bench: &Bench) {
    let points = GRID_UM.map(|y| GRID_UM.map(|x| format!("{x},{y}\n")).concat());
    std::fs::write(bench.directory().join("grid.csv"), points.concat()).expect("written");
}

const WORDS: [&str; 10] = [
    "measure", "plane", "0V", "1V", "2V", "--points", "grid.csv", "--settle", "1s", "--json",
];

#[test]
fn a_scan_finds_the_angles_that_the_plate_has() {
    let mut bench = Bench::emulated(config());
    grid(&bench);
    let mut tool = bench.talk_to_tool(&WORDS);
    let err = scan(&mut bench, &mut tool, usize::MAX, |tool| interrupt(tool));
    let said = Said::from(tool);
    assert_eq!(said.code, 0, "{err}");

    let mut mirror = VirtualMirror::new(&config()).expect("valid");
    mirror.advance([2.0; 4], 2.0);
    let state = mirror.state();
    let report: serde_json::Value = serde_json::from_str(&said.out).expect("JSON");
    let found = |angle: &str| report["levels"][2][angle].as_f64().expect("a number");
    let most = state.tilt_x_deg.abs().max(state.tilt_y_deg.abs());
    // Four times what a scan may miss.
    assert!(most > 0.02, "it hardly tilts: {most}");
    // A scan of nine readings of 20 nm over 1 mm finds an angle to 0.001 deg, 5 % of the least tilt; creep during the scan
    // and the drive's tolerances add as much.
    // The plate's own tilt about y is positive where its +x edge is nearer, which turns it the other way.
    for (found, is) in [
        (found("tilt_x_deg"), state.tilt_x_deg),
        (found("tilt_y_deg"), -state.tilt_y_deg),
    ] {
        assert!((found - is).abs() < 0.1 * most, "{found} for {is}");
    }

    let file = bench.directory().join("plane.csv");
    let session = Session::load(&[file]).expect("a measurement file");
    let rows = &session.files[0].1.rows;
    let volts: Vec<f64> = rows.iter().map(|row| row.voltage_v[0]).collect();
    assert_eq!(volts, [0.0, 1.0, 2.0]);
    assert_eq!(rows[0].z_um, Some(0.0));
    // Creep and the drive's tolerances again: 0.1 um of some 70 um.
    assert!((rows[2].z_um.unwrap() - state.z_um).abs() < 0.1);
    let again = bench.json(&["measure", "plane", "--from", "plane.3.xyz"]);
    assert_eq!(again["points"], 9);
    // The file has three decimals of a micrometre, over 1 mm.
    assert!((again["tilt_x_deg"].as_f64().unwrap() - found("tilt_x_deg")).abs() < 1e-3);
    assert!(bench.is_off());
}

#[test]
fn ctrl_c_leaves_the_channels_off_and_the_points_that_were_read() {
    let mut bench = Bench::emulated(config());
    grid(&bench);
    let mut tool = bench.talk_to_tool(&WORDS);
    let err = scan(&mut bench, &mut tool, 22, |tool| interrupt(tool));
    let said = Said::from(tool);
    // 128 and the signal's number.
    assert_eq!(said.code, 130, "{err}");
    assert!(said.out.contains("\"interrupted\":true"), "{}", said.out);
    assert!(bench.is_off());
    let read = |name: &str| std::fs::read_to_string(bench.directory().join(name));
    let whole = read("plane.2.xyz").expect("a scan");
    assert_eq!(whole.lines().count(), 2 + 9, "{whole}");
    let part = read("plane.3.xyz").expect("the scan so far");
    assert!(part.contains("partial=interrupted"), "{part}");
    let points = part.lines().count() - 3;
    assert!((3..=4).contains(&points), "{part}");
    let file = bench.directory().join("plane.csv");
    let session = Session::load(&[file]).expect("a measurement file");
    assert_eq!(session.files[0].1.keys.get("partial"), Some("interrupted"));
    assert_eq!(session.files[0].1.rows.len(), 2);
}

#[test]
fn kill_9_leaves_the_points_that_were_read() {
    let mut bench = Bench::emulated(config());
    grid(&bench);
    let mut tool = bench.talk_to_tool(&WORDS);
    scan(&mut bench, &mut tool, 23, |tool| {
        tool.kill().expect("it dies")
    });
    let read = |name: &str| std::fs::read_to_string(bench.directory().join(name));
    let whole = read("plane.2.xyz").expect("a scan");
    assert_eq!(whole.lines().count(), 2 + 9, "{whole}");
    let part = read("plane.3.xyz").expect("the scan so far");
    assert!(part.contains("partial=the scan did not end"), "{part}");
    let points = part.lines().count() - 3;
    assert!((4..=5).contains(&points), "{part}");
    let again = bench.json(&["measure", "plane", "--from", "plane.3.xyz"]);
    assert_eq!(again["points"], points);
}

#[test]
fn a_point_is_not_read_of_a_mirror_that_is_no_longer_driven() {
    let mut bench = Bench::on_host(config());
    grid(&bench);
    let mut tool = bench.talk_to_tool(&WORDS);
    let mut person = Person::at(&mut tool);
    person.answer(&mut bench, 20);
    // As a machine that sleeps: by then the lease has lapsed, and the drives have ramped to zero.
    signal(&tool, "STOP");
    bench.wait_until_s(bench.simulated_s() + 1.0);
    signal(&tool, "CONT");
    person.answer(&mut bench, 1);
    person.hear_the_rest();
    let said = Said::from(tool);
    assert_eq!(said.code, 1);
    let report: serde_json::Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(report["levels"].as_array().map(Vec::len), Some(2));
    let part = std::fs::read_to_string(bench.directory().join("plane.3.xyz")).expect("so far");
    assert!(part.contains("did not drive what was asked"), "{part}");
    let points = part.lines().count() - 3;
    assert!((1..=2).contains(&points), "{part}");
    assert!(bench.is_off());
}

#[test]
fn points_that_span_no_plane_are_refused_before_anything_moves() {
    let bench = Bench::emulated(config());
    std::fs::write(bench.directory().join("grid.csv"), "0,0\n10,10\n20,20\n").expect("written");
    let said = bench.tool(&WORDS);
    assert_ne!(said.code, 0);
    assert!(
        said.sentence().contains("its 3 points span no plane"),
        "{}",
        said.err
    );
    assert!(!bench.directory().join("plane.csv").exists());

    grid(&bench);
    // Nobody answers.
    let said = bench.tool(&WORDS);
    assert!(
        said.sentence().contains("the input ended before"),
        "{}",
        said.err
    );
}
