//! A calibration by a sensor that is not as it should be: nothing is kept for good that the mirror does not bear out.

use emulated_board::PlantFault;
use experiments::Experiment;
use hil::Bench;
use serde_json::Value;
use virtual_mirror::{Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

/// A board with a mirror that was measured by a good sensor before: what the sensor at the board does is all that is bad.
fn bench() -> Bench {
    let config = MirrorConfig::draw(Family::B, 77);
    let bench = Bench::emulated(config.clone());
    let experiments = vec![
        Experiment::sweep(3.5, 14, 1.0, 1),
        Experiment::step(2.0, 10.0, 5e3).after(5.0),
    ];
    let session = measure(&config, &experiments, Instruments::PositionAndCurrents);
    let folder = bench.directory().join("session");
    std::fs::create_dir(&folder).expect("a folder");
    for (name, file) in session.expect("the mirror is possible").files {
        std::fs::write(folder.join(name), file.to_string()).expect("written");
    }
    bench
}

const CALIBRATE: [&str; 4] = ["calibrate", "--quick", "--from", "session"];

fn kept(bench: &Bench) -> Value {
    bench.json(&["status"])["calibration"]["kept"].clone()
}

/// Calibrates with a sensor that fails so; what the tool says, where it refuses to.
fn refused(fault: PlantFault) -> String {
    let bench = bench();
    bench.controls().inject(Some(fault));
    let said = bench.tool(&CALIBRATE);
    assert_ne!(said.code, 0, "{fault:?} was kept: {}", said.out);
    assert_eq!(kept(&bench), "Factory");
    said.err
}

#[test]
#[ignore = "long"]
fn a_sensor_whose_range_ends_in_the_mirror_s_is_no_calibration() {
    let said = refused(PlantFault::ClippedSensor);
    assert!(said.contains("at an end of its range"), "{said}");
}

#[test]
#[ignore = "long"]
fn a_late_sensor_is_no_lag_of_the_mirror() {
    let said = refused(PlantFault::LateSensor);
    assert!(said.contains("late"), "{said}");
}

#[test]
#[ignore = "long"]
fn a_sensor_that_is_off_is_named() {
    let said = refused(PlantFault::NoSensor);
    assert!(said.contains("sensor"), "{said}");
}
