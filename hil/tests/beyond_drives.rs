//! What a person moves or warms on the bench while the tool measures, and that every measurement which a diagnosis may propose runs.

use std::collections::HashSet;
use std::io::{BufRead, BufReader, Write};

use hil::{Bench, Said, interrupt};
use measurement::Session;
use virtual_mirror::{Effect, MirrorConfig};

/// Runs the tool, and wherever it asks for a height moves the stage there and presses Enter.
fn with_a_stage(bench: &mut Bench, words: &[&str]) -> Said {
    with_a_stage_at(bench, words, usize::MAX, |um| um)
}

/// The same for so many heights, after which the input ends; the stage goes where `stands` says that it does when it is asked to go
/// somewhere.
fn with_a_stage_at(
    bench: &mut Bench,
    words: &[&str],
    heights: usize,
    stands: impl Fn(f64) -> f64,
) -> Said {
    let mut tool = bench.talk_to_tool(words);
    let mut keys = tool.stdin.take();
    let mut answered = 0;
    let said = BufReader::new(tool.stderr.take().expect("piped"));
    let mut err = String::new();
    for line in said.lines() {
        let line = line.expect("text");
        if let Some((_, rest)) = line.split_once("move the stage to ") {
            let (um, _) = rest.split_once(" um").expect("a height");
            let um = stands(um.parse().expect("a number"));
            bench.controls().move_stage(um);
            match &mut keys {
                Some(keys) if answered < heights => writeln!(keys).expect("it listens"),
                _ => drop(keys.take()),
            }
            answered += 1;
        }
        err += &line;
    }
    Said {
        err,
        ..Said::from(tool)
    }
}

const HEIGHTS: [&str; 7] = [
    "measure",
    "reference",
    "0um",
    "60um",
    "0.12mm",
    "--settle",
    "100ms",
];

#[test]
fn a_stage_s_steps_are_read_with_the_sensor_s_gain() {
    let mut bench = Bench::emulated(MirrorConfig::bench().with_effect(Effect::SensorGain, 3.0));
    let said = with_a_stage(&mut bench, &HEIGHTS);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(bench.is_off());
    let file = bench.measured("reference.csv");
    let read: Vec<_> = file
        .rows
        .iter()
        .map(|row| (row.reference_um, row.z_um))
        .collect();
    assert_eq!(read[0], (Some(0.0), Some(0.0)));
    for (reference_um, z_um) in read {
        let off = z_um.unwrap() - 1.03 * reference_um.unwrap();
        // Two readings, of 20 nm of noise and as much of wander each.
        assert!(off.abs() < 0.1, "{z_um:?} at {reference_um:?}");
    }
    assert!(file.keys.session().is_some());
}

/// What a mirror still moves by on its way to rest would be the sensor's.
#[test]
fn heights_are_read_of_a_mirror_at_rest() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    bench.json(&["set-z", "140um"]);
    let said = with_a_stage(&mut bench, &HEIGHTS);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(
        said.err.contains("letting the mirror come to rest"),
        "{}",
        said.err
    );
    for row in bench.measured("reference.csv").rows {
        let off_um = row.z_um.expect("read") - row.reference_um.expect("asked");
        // A mirror that was 140 um up a second ago is 1.6 um off.
        assert!(off_um.abs() < 0.1, "{row:?}");
    }
}

#[test]
fn a_stage_that_is_not_moved_or_moves_the_other_way_is_told() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    for (stands, told) in [
        ((|_| 0.0) as fn(f64) -> f64, "was the stage moved?"),
        (
            |um| -um,
            "it moved the other way, or the sensor counts the other way",
        ),
        (|um| 25.4 * um, "in another unit?"),
    ] {
        let said = with_a_stage_at(&mut bench, &HEIGHTS, usize::MAX, stands);
        assert_eq!(said.code, 1, "{said:?}");
        assert!(said.err.contains(told), "{}", said.err);
        assert!(!bench.directory().join("reference.csv").exists());
    }
}

#[test]
fn an_oven_shows_in_the_resistance_and_its_file_belongs_to_the_session() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let cold = |bench: &Bench, ambient: &str, output: &str| {
        let words = [
            "measure",
            "held",
            "0V",
            "0.4V",
            "--dwell",
            "2s",
            "--rest",
            "1s",
            "--ambient",
            ambient,
            "-o",
            output,
        ];
        bench.json(&words);
        let rows = bench.measured(output).rows;
        0.4 / rows[1].current_a[0].expect("sensed")
    };
    let room_ohm = cold(&bench, "22", "room.csv");
    bench.controls().set_oven(62.0);
    let oven_ohm = cold(&bench, "62", "oven.csv");
    let per_kelvin = (oven_ohm / room_ohm - 1.0) / 40.0;
    let tcr = MirrorConfig::bench().heater.tcr_per_k;
    // A sense that nobody calibrated is off by some uA of 1 mA, and the oven makes 16 % of the resistance.
    assert!(
        (per_kelvin / tcr - 1.0).abs() < 0.1,
        "{per_kelvin} for {tcr}"
    );
    let session = Session::load(&["oven.csv", "room.csv"].map(|name| bench.directory().join(name)));
    let files = session.expect("a session").files;
    let order: Vec<_> = files.iter().map(|(_, file)| file.ambient_c()).collect();
    assert_eq!(
        order,
        [Some(22.0), Some(62.0)],
        "the room was measured first"
    );
    assert!(!files[0].1.shares_clock(&files[1].1));
}

#[test]
fn ctrl_d_leaves_the_heights_that_were_read() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    let said = with_a_stage_at(&mut bench, &HEIGHTS, 2, |um| um);
    assert_ne!(said.code, 0);
    assert!(said.err.contains("the input ended before"), "{}", said.err);
    let file = bench.measured("reference.csv");
    assert_eq!(file.rows.len(), 2);
    assert!(file.keys.get("partial").is_some());
}

/// The same command with shorter times, fewer steps, and a file of this number.
fn short(command: &str, number: usize) -> Vec<String> {
    let mut words: Vec<String> = command.split(' ').skip(1).map(str::to_owned).collect();
    let mut set = |option: &str, value: &str| match words.iter().position(|word| word == option) {
        Some(at) => words[at + 1] = value.to_owned(),
        None => words.extend([option, value].map(str::to_owned)),
    };
    let is_session = command.contains("measure session");
    set(
        "-o",
        &format!("{number}{}", if is_session { "" } else { ".csv" }),
    );
    let short: &[(&str, &str)] = match command.split(' ').nth(2).expect("an experiment") {
        "sweep" | "single" => &[("--steps", "2"), ("--dwell", "50ms"), ("--rest", "0s")],
        "step" => &[("--hold", "100ms"), ("--rest", "0s")],
        "sine" => &[("--cycles", "1"), ("--rest", "0s")],
        "reference" => &[("--settle", "10ms")],
        "session" => &[],
        other => panic!("no short version of {other}"),
    };
    for (option, value) in short {
        set(option, value);
    }
    if command.contains("0.01Hz") {
        set("--frequency", "1Hz");
    }
    words
}

/// The beginning of what takes minutes as a whole: Ctrl-C once it drives.
fn begin(bench: &Bench, words: &[&str]) -> Said {
    let tool = bench.start_tool(words);
    bench.wait_until_driven(10_000);
    interrupt(&tool);
    let said = Said::from(tool);
    assert!(bench.is_off());
    said
}

/// 128 and the signal's number.
const BY_INTERRUPT: i32 = 130;

/// The first of each kind of measurement, and where a long run asks for it every one, and a session as a whole.
#[test]
fn every_measurement_that_may_be_proposed_runs_on_a_board() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    let mut kinds = HashSet::new();
    for (number, proposal) in diagnosis::proposals(3.5).iter().enumerate() {
        let command = host_tool::command_line::proposal_line(proposal);
        let kind = command.split(' ').nth(2).expect("an experiment");
        if !kinds.insert(kind.to_owned()) && !long_runs::are_asked_for() {
            continue;
        }
        let words = short(&command, number);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let file = words[1 + words.iter().position(|word| *word == "-o").expect("a name")];
        let (said, code) = if command.contains("measure session") && !long_runs::are_asked_for() {
            // A board whose driven ticks nobody has counted yet.
            bench = Bench::emulated(MirrorConfig::bench());
            (begin(&bench, &words), BY_INTERRUPT)
        } else {
            (with_a_stage(&mut bench, &words), 0)
        };
        assert_eq!(said.code, code, "{command}: {}", said.err);
        // A session is a folder.
        let session = Session::load(&[bench.directory().join(file)]);
        for (name, file) in session.expect("it is read again").files {
            assert!(
                file.has_displacement() && file.has_current(),
                "{command}: {name}"
            );
        }
    }
    assert!(kinds.len() > 4, "{kinds:?}");
}
