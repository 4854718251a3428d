//! Poses, as a user asks for them: refused where they cannot be, and where they can the plate turns.

use calibration::{tabulate, to_toml};
use control_core::calibration::{Parts, Plate};
use control_core::{Calibration, Micrometre};
use hil::Bench;
use mirror_model::{Model, Preset};
use virtual_mirror::MirrorConfig;

/// The factory's calibration, with the levers of the virtual mirror's plate.
fn with_levers(config: &MirrorConfig) -> String {
    let factory = tabulate(&Model::from(Preset::Reconciled)).expect("a calibration");
    let parts = Parts {
        plate: Plate::cross(Micrometre(config.plate.lever_um as f32)),
        ..*factory.calibration.parts()
    };
    to_toml(&Calibration::new(parts).expect("levers only"))
}

/// Height of the plate above three spots (um).
fn heights_um(bench: &mut Bench, words: &[&str]) -> [f64; 3] {
    [[0.0, 0.0], [0.0, SPOT_UM], [SPOT_UM, 0.0]].map(|spot| {
        bench.controls().move_spot(spot);
        bench.json(words)["sensor_z_um"]
            .as_f64()
            .expect("a virtual sensor")
    })
}

const SPOT_UM: f64 = 200.0;

#[test]
fn a_pose_turns_the_plate_and_one_out_of_reach_is_refused_with_the_nearest() {
    let config = MirrorConfig::bench();
    let mut bench = Bench::emulated(config.clone());
    let unknown = bench.tool(&["set-pose", "60um", "0.5deg", "0deg"]);
    assert_ne!(unknown.code, 0);
    assert!(
        unknown
            .sentence()
            .contains("does not know the plate's levers"),
        "{}",
        unknown.err
    );
    assert!(bench.json(&["range"])["tilts"].is_null());
    for (picture, told) in [
        ("range.svg", "there are no tilts to draw"),
        ("range.png", "under a name that says otherwise"),
    ] {
        let said = bench.tool(&["range", "--picture", picture]).sentence();
        assert!(said.contains(told), "{said}");
        assert!(!said.contains("moved"), "nothing was asked to move: {said}");
    }

    let file = bench.directory().join("levers.toml");
    std::fs::write(&file, with_levers(&config)).expect("written");
    bench.json(&["load-calibration", "levers.toml"]);
    let too_far = bench.tool(&["set-pose", "60um", "40deg", "0deg"]);
    assert_ne!(too_far.code, 0);
    assert!(
        too_far.sentence().contains("the nearest pose in reach"),
        "{}",
        too_far.err
    );
    assert_eq!(bench.json(&["range"])["tilts"][0]["tilt_deg"], 0.0);

    let level = heights_um(&mut bench, &["set-pose", "60um", "0deg", "0deg"]);
    let words = ["set-pose", "60um", "0.5deg", "-0.3deg"];
    let tilted = heights_um(&mut bench, &words);
    let [piston, along_y, along_x]: [f64; 3] = std::array::from_fn(|i| tilted[i] - level[i]);
    let turned = |along: f64| ((along - piston) / SPOT_UM).atan().to_degrees();
    // The factory's tables are another mirror's, by a few percent a slope.
    assert!((turned(along_y) - 0.5).abs() < 0.1, "{level:?} {tilted:?}");
    // Right-handed about y: where it is negative, z rises along x.
    assert!((turned(along_x) - 0.3).abs() < 0.06, "{level:?} {tilted:?}");
    let told = bench.json(&["status"]);
    let pose = &told["pose"];
    let near = |name: &str, value: f64| (pose[name].as_f64().expect("told") - value).abs() < 1e-3;
    assert!(
        near("z_um", 60.0) && near("tilt_x_deg", 0.5) && near("tilt_y_deg", -0.3),
        "{pose}"
    );
}

/// The nearest pose as a user types what is told: `40.000 um with +5.3772 deg about x and +0.0000 deg about y`.
fn typed_nearest(told: &str) -> [String; 3] {
    let (_, nearest) = told.split_once("in reach is ").expect("the nearest pose");
    let told: Vec<&str> = nearest.split_whitespace().collect();
    [(0, "um"), (3, "deg"), (8, "deg")].map(|(word, unit)| told[word].to_owned() + unit)
}

/// What `calibrate` and then `calibrate-pose` made of the paper's virtual mirror, whose actuators share a frame that warms.
const PAPER: &str = include_str!("paper-with-tilts.toml");

#[test]
fn a_pose_that_other_actuators_keep_too_warm_is_refused_and_the_nearest_is_held() {
    let mut bench = Bench::emulated(MirrorConfig::paper());
    std::fs::write(bench.directory().join("paper.toml"), PAPER).expect("written");
    bench.json(&["load-calibration", "paper.toml"]);
    println!("{}", bench.tool(&["range"]).out);
    // Without shared heat a tilt of 1.2 deg is reached from 2.4 um on, with the smallest warp that is enough.
    let range = bench.json(&["range"]);
    let low_um = range["tilts"][1]["about_x_um"][0].as_f64();
    assert!(low_um.expect("a piston") > 8.0, "{range}");

    // Until a board knows its room, what it tells of it moves the edge of what is held.
    bench.json(&["room", "off"]);
    let too_warm = bench.tool(&["set-pose", "40um", "6deg", "0deg"]);
    println!("{}", too_warm.err);
    let told = too_warm.sentence();
    assert_ne!(too_warm.code, 0, "{told}");
    assert!(told.contains("keeps actuator 4 too warm"), "{told}");
    assert!(bench.is_off());
    let typed = typed_nearest(&told);
    let [z, tilt_x, tilt_y] = typed.each_ref().map(String::as_str);
    let settle = ["--settle", "5s"];
    let nearest = [&["set-pose", z, tilt_x, tilt_y], &settle[..]].concat();
    // From rest, for a mirror that comes from above has to cool on its way.
    let held = bench.json(&nearest);
    let limits = held["limited_by"].as_array().expect("names");
    assert!(!limits.contains(&"cooling".into()), "{held}");
    let level = heights_um(
        &mut bench,
        &[&["set-pose", z, "0deg", "0deg"], &settle[..]].concat(),
    );
    let tilted = heights_um(&mut bench, &nearest);
    let tilt_deg = ((tilted[1] - tilted[0] - level[1] + level[0]) / SPOT_UM)
        .atan()
        .to_degrees();
    let asked_deg: f64 = tilt_x.trim_end_matches("deg").parse().expect("a number");
    // Some times what random poses are off by (docs/theory/pose.md), for a heater without power tells nothing.
    assert!((tilt_deg - asked_deg).abs() < 0.1, "{tilt_deg} deg");

    // A scan is warned of, and the board names what holds it back.
    let circle = ["scan", "circle", "--offset", "40um", "--radius"];
    let scan = |radius: &str| {
        let timing = ["--frequency", "1Hz", "--cycles", "3"];
        let said = bench.tool(&[&circle[..], &[radius], &timing].concat());
        println!("{}{}", said.err, said.out);
        assert_eq!(said.code, 0, "{}", said.err);
        said
    };
    let wide = scan("6deg");
    assert!(
        wide.sentence()
            .contains("do not hold all of these poses at rest"),
        "{}",
        wide.err
    );
    assert!(wide.out.contains("cooling"), "{}", wide.out);
    let narrow = scan("2deg");
    assert!(!narrow.err.contains("at rest"), "{}", narrow.err);
    assert!(!narrow.out.contains("cooling"), "{}", narrow.out);
}

/// The same, up to where poses beyond what was tried have taken the range since (`closed-loop`, test `pose`).
const TO_ITS_TOP: &str = include_str!("paper-to-its-top.toml");

#[test]
fn a_pose_that_takes_more_than_the_highest_drive_is_refused_and_the_nearest_is_held() {
    let bench = Bench::emulated(MirrorConfig::paper());
    std::fs::write(bench.directory().join("paper.toml"), TO_ITS_TOP).expect("written");
    bench.json(&["load-calibration", "paper.toml"]);
    bench.json(&["room", "off"]);
    println!("{}", bench.tool(&["range"]).out);

    let too_far = bench.tool(&["set-pose", "122um", "12deg", "0deg"]);
    println!("{}", too_far.err);
    let told = too_far.sentence();
    assert_ne!(too_far.code, 0, "{told}");
    assert!(
        told.contains("actuator 2 would take more than the highest drive"),
        "{told}"
    );
    assert!(bench.is_off());
    let nearest = typed_nearest(&told);
    let [z, tilt_x, tilt_y] = nearest.each_ref().map(String::as_str);
    // Until what the actuators share is warm it takes more, and the report names what has acted on the way.
    let settled = |settle: &str| bench.json(&["set-pose", z, tilt_x, tilt_y, "--settle", settle]);
    settled("20s");
    let held = settled("1s");
    println!("{held}");
    let limits = held["limited_by"].as_array().expect("names");
    assert!(limits.is_empty(), "{held}");
}
