//! A calibrated mirror in other rooms than that of its calibration, with what a kelvin is worth to it measured in two of them.

use std::fs;

use emulated_board::PlantFault;
use hil::{Bench, Said, interrupt};
use serde_json::Value;
use virtual_mirror::{Family, MirrorConfig};

/// What `calibrate --quick` made of this mirror (`calibrate.rs`, a long run), but for the ambient ratio, which is that of a mirror
/// that nobody has measured.
const CALIBRATION: &str = include_str!("mirror-77.toml");
const FILE: &str = "mirror.toml";

fn bench() -> (Bench, f64) {
    let config = MirrorConfig::draw(Family::B, 77);
    let ambient_c = config.ambient_c;
    let bench = Bench::emulated(config);
    fs::write(bench.directory().join(FILE), CALIBRATION).expect("written");
    bench.json(&["load-calibration", FILE]);
    (bench, ambient_c)
}

/// How far the plate is from where it is asked to be (um).
fn errors_um(bench: &Bench) -> [f64; 3] {
    // Two positions tell the room and the loss apart.
    bench.json(&["set-z", "60um", "--settle", "1s"]);
    [120.0, 60.0, 90.0].map(|um| {
        bench.json(&["set-z", &format!("{um}um"), "--settle", "1s"]);
        bench.controls().plate_um() - um
    })
}

fn largest(errors: &Value) -> f64 {
    let errors = errors.as_array().expect("a list").iter();
    let sizes = errors.map(|error| error.as_f64().expect("a number").abs());
    sizes.fold(0.0, f64::max)
}

#[test]
fn what_a_kelvin_is_worth_is_measured_in_two_rooms_and_holds_in_a_third() {
    let (bench, ambient_c) = bench();
    // The sensor's zero is anywhere, and stays there.
    bench.controls().move_stage(25.0);
    let ask = ["calibrate-room", FILE, "room.json", "--settle", "600ms"];
    let first = bench.json(&ask);
    assert_eq!(first["points"].as_array().map(Vec::len), Some(3), "{first}");
    let same = bench.tool(&ask);
    assert!(same.sentence().contains("K apart"), "{}", same.err);

    bench.controls().set_oven(ambient_c + 11.0);
    let second = bench.json(&[&ask[..], &["-o", "any-room.toml"]].concat());
    println!("{second}");
    let rise_k = |when: &str| second[when].as_f64().expect("a number");
    // The room by four resistances, whose coefficient is known to some percent (docs/theory/surroundings.md).
    assert!((rise_k("rise_now_k") - rise_k("rise_then_k") - 11.0).abs() < 0.6);
    // What is required of any room (docs/requirements.md); the readings' noise is a hundredth of it.
    assert!(largest(&second["after_um"]) < 0.5, "{second}");
    assert!(
        largest(&second["after_um"]) < largest(&second["before_um"]),
        "{second}"
    );
    let written = fs::read_to_string(bench.directory().join("any-room.toml")).expect("written");
    let written = calibration::from_toml("any-room.toml", &written).expect("a calibration");
    let ratio = f64::from(written.parts().ambient_ratio);
    assert!((ratio - second["ratio"].as_f64().expect("a number")).abs() < 1e-6);

    bench.controls().set_oven(ambient_c - 7.0);
    let errors_um = errors_um(&bench);
    println!("7 K colder: {errors_um:.2?} um");
    assert!(errors_um.iter().all(|um| um.abs() < 0.5), "{errors_um:?}");
}

/// What the first room's readings were under the ratio of before is no error of what was found: a mirror that comes back to the room of its
/// calibration stands there as before.
#[test]
fn the_other_room_may_be_the_first() {
    let (bench, ambient_c) = bench();
    let far_off = CALIBRATION.replace("ambient_ratio = 1.02", "ambient_ratio = 1.12");
    fs::write(bench.directory().join(FILE), far_off).expect("written");
    // No room jumps while a board compares the heaters with a calibration that was just loaded.
    bench.controls().set_oven(ambient_c + 11.0);
    bench.json(&["load-calibration", FILE]);
    let ask = ["calibrate-room", FILE, "room.json", "--settle", "600ms"];
    bench.json(&ask);
    bench.controls().set_oven(ambient_c);
    let second = bench.json(&ask);
    println!("{second}");
    let [before_um, after_um] = ["before_um", "after_um"].map(|when| largest(&second[when]));
    // A tenth of 11 K, at 1.8 um/K; and what is required of any room (docs/requirements.md).
    assert!(before_um > 1.0 && after_um < 0.5, "{second}");
    let ratio = second["ratio"].as_f64().expect("a number");
    assert!((ratio - 1.02).abs() < 0.03, "{second}");
}

/// A calibration tells its mirror in any room, and as warm as a mirror is that was held where it tilts most.
#[test]
fn a_calibration_is_taken_by_its_own_mirror_only() {
    const PAPER: &str = include_str!("paper.toml");
    let bench = Bench::emulated(MirrorConfig::paper());
    let write = |name: &str, text: &str| {
        fs::write(bench.directory().join(name), text).expect("written");
    };
    write("77.toml", CALIBRATION);
    write("paper.toml", PAPER);
    let room_c = MirrorConfig::paper().ambient_c;
    for warmer_k in [0.0, 9.0] {
        bench.controls().set_oven(room_c + warmer_k);
        bench.json(&["load-calibration", "paper.toml"]);
        let other = bench.tool(&["load-calibration", "77.toml"]);
        assert_eq!(other.code, 1, "{other:?}");
        let said = other.sentence();
        for words in [
            "77.toml is of another mirror",
            "354.4, 352.4, 353.6, 351.8 ohm",
            "the board keeps the calibration that it had",
        ] {
            assert!(said.contains(words), "`{words}` is not in: {said}");
        }
        assert!(bench.is_off());
        let status = bench.json(&["status"]);
        assert_eq!(status["calibration"]["device"], "paper", "{status}");
    }
    let tilt = ["set-drive", "3.5V", "0V", "0V", "0V", "--settle", "30s"];
    bench.json(&tilt);
    bench.json(&["load-calibration", "paper.toml"]);
    bench.json(&["load-calibration", "77.toml", "--other-mirror"]);
    let back = bench.json(&["load-calibration", "paper.toml"]);
    assert!(
        back["before"].as_str().expect("text").contains("77"),
        "{back}"
    );
}

/// The board itself notices it where nobody compares: a position may be anywhere at once, and `calibration-drifted` is told when heat from before
/// would have left, at rest and in use; its own calibration ends it.
#[test]
fn a_board_under_another_mirrors_calibration_says_so() {
    let (bench, _) = bench();
    fs::write(
        bench.directory().join("paper.toml"),
        include_str!("paper.toml"),
    )
    .expect("written");
    let width_um = |told: &Value| told["uncertainty"]["z_um"].as_f64().expect("a number");
    let is_drifted = |told: &Value| told.to_string().contains("calibration-drifted");
    let moved = || bench.json(&["set-z", "60um", "--settle", "1s"]);
    let own = moved();
    assert!(width_um(&own) < 10.0 && !is_drifted(&own), "{own}");
    bench.json(&["off"]);
    bench.wait_until_s(bench.simulated_s() + 5.0);
    bench.json(&["load-calibration", "paper.toml", "--other-mirror"]);
    let at_once = moved();
    assert!(width_um(&at_once) > 60.0, "{at_once}");
    bench.json(&["off"]);
    let since_s = bench.simulated_s();
    bench.wait_until_s(since_s + 23.0);
    let at_rest = bench.json(&["status"]);
    assert!(is_drifted(&at_rest), "{at_rest}");
    let in_use = moved();
    assert!(is_drifted(&in_use) && width_um(&in_use) > 60.0, "{in_use}");
    bench.json(&["load-calibration", FILE]);
    let own = moved();
    assert!(width_um(&own) < 10.0 && !is_drifted(&own), "{own}");
}

/// What has tripped it may be a calibration of another mirror.
#[test]
fn a_board_that_has_tripped_takes_a_calibration_unread() {
    let (bench, _) = bench();
    bench.json(&["set-z", "60um", "--settle", "10ms", "--hold", "10s"]);
    bench.controls().inject(Some(PlantFault::OpenHeater(1)));
    bench.wait_for_status("it trips", |status| {
        status["states"].to_string().contains("tripped")
    });
    bench.controls().inject(None);
    let loaded = bench.tool(&["load-calibration", FILE]);
    assert_eq!(loaded.code, 0, "{}", loaded.err);
    let said = loaded.sentence();
    assert!(said.contains("the board has turned itself off"), "{said}");
    assert!(said.contains("`host-tool clear`"), "{said}");
}

#[test]
fn one_that_is_interrupted_turns_the_mirror_off_and_keeps_nothing() {
    let (bench, _) = bench();
    bench.json(&["room", "off"]);
    let tool = bench.start_tool(&["calibrate-room", FILE, "room.json", "--settle", "1h"]);
    // Not by its drives, which are counted until they first come to zero.
    bench.wait("the plate stays at rest", |bench| {
        bench.controls().plate_um() > 10.0
    });
    interrupt(&tool);
    let said = Said::from(tool);
    assert_eq!(said.code, 130, "{}", said.err);
    let sentence = said.sentence();
    assert!(sentence.contains("channels are off"), "{sentence}");
    assert!(bench.is_off());
    assert!(!bench.directory().join("room.json").exists());
    let room = &bench.json(&["room"])["room"];
    assert_eq!(room["is_compensated"], false, "{room}");
}

#[test]
fn readings_that_cannot_be_compared_are_told_and_change_nothing() {
    let (bench, ambient_c) = bench();
    let place = |name: &str| bench.directory().join(name);
    let refused = |words: &[&str], said: &str| {
        let tool = bench.tool(words);
        assert_eq!(tool.code, 1, "{}", tool.out);
        let told = tool.sentence();
        assert!(told.contains(said), "`{said}` is not in: {told}");
        assert!(bench.is_off());
    };
    fs::write(place("rubbish.json"), "t_s,V_V\n0,1\n").expect("written");
    refused(
        &["calibrate-room", FILE, "rubbish.json"],
        "does not hold what a sensor read",
    );
    refused(
        &["calibrate-room", "nowhere.toml", "room.json"],
        "nowhere.toml",
    );
    let of_another = CALIBRATION.replace("mirror 77", "mirror 78");
    fs::write(place("other.toml"), of_another).expect("written");
    refused(
        &["calibrate-room", "other.toml", "room.json"],
        "is not the calibration that the board uses",
    );
    // So warm that a heater would have to cool.
    bench.controls().set_oven(ambient_c + 45.0);
    refused(&["calibrate-room", FILE, "room.json"], "room-warm");
    assert!(!place("room.json").exists());
}

#[test]
fn in_a_warm_room_the_range_begins_where_the_mirror_rests() {
    let (bench, ambient_c) = bench();
    let lowest_um = || {
        let range = bench.json(&["range"]);
        range["lowest_position_um"].as_f64().expect("a number")
    };
    assert_eq!(lowest_um(), 0.0);
    bench.controls().set_oven(ambient_c + 8.0);
    // The board does not know of it yet, and a heater cannot cool: neither where the mirror is nor when it comes is told.
    let warm = bench.json(&["set-z", "5um", "--settle", "1s"]);
    let told = &warm["uncertainty"];
    assert!(
        told["z_um"].is_null() && told["settles_in_s"].is_null(),
        "{warm}"
    );
    errors_um(&bench);
    // What is required of any room (docs/requirements.md), of some 1.8 um/K.
    let lowest = lowest_um();
    let asked = format!("{lowest:.3}um");
    bench.json(&["set-z", &asked, "--settle", "1s"]);
    let off_um = bench.controls().plate_um() - lowest;
    assert!(lowest > 10.0 && off_um.abs() < 0.5, "{lowest} um, {off_um}");
    let refused = bench.tool(&["set-z", "5um"]);
    assert_eq!(refused.code, 1, "{}", refused.out);
    let said = refused.sentence();
    assert!(said.contains("rests at"), "{said}");
    let refused = bench.tool(&[
        "scan",
        "sine",
        "--offset",
        "20um",
        "--amplitude",
        "15um",
        "--frequency",
        "5Hz",
    ]);
    assert!(refused.sentence().contains("rests at"), "{}", refused.err);
    // A scan counts from where the plate rests in the room of the calibration, and begins here where it rests in this one.
    bench.json(&["off"]);
    bench.wait("the plate rests", |bench| {
        (bench.controls().plate_um() - lowest).abs() < 0.5
    });
    let scan = bench.json(&[
        "scan",
        "sine",
        "--offset",
        "60um",
        "--amplitude",
        "20um",
        "--frequency",
        "1Hz",
    ]);
    let error_um = scan["following"]["mean_error_um"]
        .as_f64()
        .expect("a sensor");
    assert!(error_um.abs() < 1.0, "{scan}");
    // A heater that is asked for no power leaves it there, once the room is told where the heat is least.
    let asked = format!("{:.3}um", lowest_um());
    bench.json(&["set-z", &asked, "--settle", "1s"]);
    let resting_um = bench.controls().plate_um();
    bench.json(&["off"]);
    bench.wait("the plate rests", |bench| {
        (bench.controls().plate_um() - resting_um).abs() < 0.5
    });
}
