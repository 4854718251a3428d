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
        too_far
            .sentence()
            .contains("the nearest pose that can be reached"),
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
