//! Drive and current sense against four known resistors in the place of the mirror, before and after the sense's
//! calibration.
//!
//! A real board takes part with `MIRROR_RESISTORS=499` (ohms, on every channel); without that it is
//! skipped, since what is connected may be a mirror.

use hil::Bench;
use measurement::{ACTUATORS, Row};
use serde_json::{Value, json};
use virtual_mirror::{Family, MirrorConfig};

/// What a board that has never been calibrated may be off by: ten times the gain's and five times the offset's tolerance in
/// `docs/board.md`, since a calibration mends whatever parts somebody took.
const BEFORE: (f64, f64) = (0.03, 20e-6);
/// And after: a sixth and an eighth of those tolerances, or the calibration was not worth its name.
const AFTER: (f64, f64) = (5e-4, 0.5e-6);

fn currents(report: &Value) -> [f64; 4] {
    std::array::from_fn(|i| report["current_a"][i].as_f64().unwrap_or(f64::NAN))
}

/// Holds one channel after the other at several voltages, the others at zero; the largest error of a driven channel, and
/// of one at zero (A).
fn loopback(bench: &Bench, ohm: f64, (part, offset_a): (f64, f64)) -> (f64, f64) {
    let (mut largest, mut at_zero) = (0.0, 0.0);
    for channel in 0..4 {
        for drive_v in [0.5, 1.5, 3.0] {
            let drives: [String; 4] = std::array::from_fn(|other| {
                if other == channel {
                    format!("{drive_v}V")
                } else {
                    "0V".to_owned()
                }
            });
            let [a, b, c, d] = drives.each_ref().map(String::as_str);
            let report = bench.json(&["set-drive", a, b, c, d, "--settle", "20ms"]);
            for (other, current_a) in currents(&report).into_iter().enumerate() {
                let flows_a = if other == channel { drive_v / ohm } else { 0.0 };
                let error_a = (current_a - flows_a).abs();
                assert!(
                    error_a <= part * flows_a + offset_a,
                    "channel {other} at {drive_v} V on channel {channel}: {current_a} A, not {flows_a}"
                );
                let worst = if other == channel {
                    &mut largest
                } else {
                    &mut at_zero
                };
                *worst = f64::max(*worst, error_a);
            }
        }
    }
    bench.json(&["off"]);
    (largest, at_zero)
}

#[test]
fn what_is_driven_is_sensed_and_a_calibration_of_the_sense_makes_it_exact_and_survives() {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let Some((bench, ohm)) = Bench::on_resistors(&flash) else {
        println!("skipped: MIRROR_RESISTORS does not say that resistors are on this board");
        return;
    };
    let before = loopback(&bench, ohm, BEFORE);
    let resistor = format!("{ohm}ohm");
    let report = bench.json(&["calibrate-sense", "--resistor", &resistor]);
    assert_eq!(report["kept"], "Yes", "{report}");
    let after = loopback(&bench, ohm, AFTER);
    println!(
        "largest error {:.1} uA before, {:.2} uA after; at zero {:.1} uA and {:.2} uA",
        before.0 * 1e6,
        after.0 * 1e6,
        before.1 * 1e6,
        after.1 * 1e6
    );
    assert!(
        after.0 < before.0 && after.1 < before.1,
        "it is worth something"
    );
    let status = bench.json(&["status"]);
    // As the board keeps them, in shorter numbers.
    let shown = status["sense_gain"][3].as_f64().expect("a number");
    let kept = report["after"]["gain"][3].as_f64().expect("a number");
    assert!((shown - kept).abs() < 1e-6, "{status}");
    assert_eq!(
        status["calibration"]["kept"], "Factory",
        "the mirror's is untouched"
    );

    // Without resistors it keeps the gains, and finds the same zero.
    let zero = bench.json(&["calibrate-sense"]);
    assert_eq!(zero["after"]["gain"], report["after"]["gain"]);
    drop(bench);
    let (bench, _) = Bench::on_resistors(&flash).expect("as before");
    loopback(&bench, ohm, AFTER);
    let forgotten = bench.json(&["calibrate-sense", "--forget-gains"]);
    assert_eq!(forgotten["before"]["gain"], report["after"]["gain"]);
    assert_eq!(forgotten["after"]["gain"], json!([1.0, 1.0, 1.0, 1.0]));
}

#[test]
fn a_wrong_resistor_is_told_and_changes_no_gain() {
    let directory = tempfile::tempdir().expect("a directory");
    let Some((bench, ohm)) = Bench::on_resistors(&directory.path().join("flash")) else {
        return;
    };
    let wrong = format!("{}ohm", 1.2 * ohm);
    let said = bench.tool(&["calibrate-sense", "--resistor", &wrong]);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    assert!(
        sentence.contains("what is on actuator 1 is not")
            && sentence
                .contains("is the mirror connected still, or another resistor than was named?"),
        "{sentence}"
    );
    let report = bench.json(&["calibrate-sense"]);
    assert_eq!(report["before"]["gain"], report["after"]["gain"]);
}

/// Heaters whose resistance at one of the drives is the one that was named.
#[test]
fn a_mirror_that_is_connected_still_is_no_resistor() {
    for mirror in [MirrorConfig::bench(), MirrorConfig::draw(Family::B, 77)] {
        let bench = Bench::emulated(mirror);
        let known = &bench.json(&["calibrate-sense"])["after"];
        for ohm in ["440ohm", "450ohm", "460ohm", "470ohm"] {
            let said = bench.tool(&["calibrate-sense", "--resistor", ohm]);
            assert_eq!(said.code, 1, "{ohm}: {said:?}");
            let sentence = said.sentence();
            for words in [
                "actuator 1 is no resistor but a heater that warms",
                "nothing was changed",
                "put the resistor in the place of each actuator",
            ] {
                assert!(sentence.contains(words), "{ohm}: {sentence}");
            }
            assert!(bench.is_off());
        }
        assert_eq!(&bench.json(&["calibrate-sense"])["before"], known);
    }
}

#[test]
fn a_resistor_that_tells_no_gain_is_refused_before_anything_changes() {
    let directory = tempfile::tempdir().expect("a directory");
    let Some((bench, _)) = Bench::on_resistors(&directory.path().join("flash")) else {
        return;
    };
    let known = &bench.json(&["calibrate-sense"])["after"];
    for ohm in ["299ohm", "1.001kohm"] {
        let said = bench.tool(&["calibrate-sense", "--resistor", ohm]);
        assert_eq!(said.code, 1, "{said:?}");
        let sentence = said.sentence();
        assert!(
            sentence.contains("300 to 1000 ohm; nothing was changed"),
            "{sentence}"
        );
    }
    assert_eq!(&bench.json(&["calibrate-sense"])["before"], known);
}

/// What the output filter's two poles at 2 kHz (docs/board.md) leave of an edge after so long is a hundredth. The board in
/// QEMU has no such filter.
const FILTER_SETTLES_S: f64 = 0.55e-3;
/// A tick: a real board's clock, and the parts of its filter, are not the twin's.
const TICK_S: f64 = 1e-4;
/// A code of the PWM, and its rounding in a file.
const CODE_V: f64 = 1.1e-3;

/// A step, as the tool measures it in currents.
fn step(bench: &Bench) -> Vec<Row> {
    let words = ["--to", "3V", "--hold", "20ms", "--rest", "50ms"];
    bench.json(&[&["measure", "step", "-o", "step.csv"][..], &words].concat());
    let mut rows = bench.measured("step.csv").rows;
    // A filter's lag after the last drive nothing was sensed any more.
    rows.retain(|row| row.current_a.iter().all(Option::is_some));
    rows
}

/// What the twin reads from so long before a time until so long after it: its least and its most.
fn around(twin: &[Row], t_s: f64, within_s: f64, of: impl Fn(&Row) -> f64) -> (f64, f64) {
    twin.iter()
        .filter(|row| (row.t_s - t_s).abs() <= within_s + 0.5 * TICK_S)
        .map(of)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
}

#[test]
fn a_step_runs_as_it_does_on_the_silicon_twin() {
    let directory = tempfile::tempdir().expect("a directory");
    let Some((bench, ohm)) = Bench::on_resistors(&directory.path().join("flash")) else {
        return;
    };
    let twin = Bench::twin_on_resistors(ohm);
    let within_s = if bench.is_emulated() {
        FILTER_SETTLES_S
    } else {
        TICK_S
    };
    let (here, there) = (step(&bench), step(&twin));
    // A stream may lose some of its readings.
    assert!(2 * here.len() > there.len() && 2 * there.len() > here.len());
    let mut largest_a = 0.0;
    for row in &here {
        for channel in 0..ACTUATORS {
            let current = |row: &Row| row.current_a[channel].expect("those without are left out");
            let drive = |row: &Row| row.voltage_v[channel];
            let (low_v, high_v) = around(&there, row.t_s, TICK_S, drive);
            let (low_a, high_a) = around(&there, row.t_s, within_s, current);
            let allowed_a = BEFORE.0 * high_a + BEFORE.1;
            let (v, a) = (drive(row), current(row));
            assert!(
                (low_v - CODE_V..=high_v + CODE_V).contains(&v)
                    && (low_a - allowed_a..=high_a + allowed_a).contains(&a),
                "at {} s, channel {}: {v} V and {a} A; the twin has {low_v} to {high_v} V and {low_a} to {high_a} A",
                row.t_s,
                channel + 1
            );
            largest_a = f64::max(largest_a, (low_a - a).max(a - high_a));
        }
    }
    println!(
        "a step of 3 V: {} readings beside {} of the twin's, off by {:.1} uA at most",
        here.len(),
        there.len(),
        largest_a * 1e6
    );
}
