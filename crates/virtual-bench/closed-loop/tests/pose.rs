//! Poses on mirrors that nothing was developed on: tilt along the piston, and poses that are asked for.

use calibration::{tabulate, with_assumed_levers};
use closed_loop::drift::{Ageing, Course, aged};
use closed_loop::pose::{
    alarms, calibrate_pose, level_tilts, peak_to_peak_deg, pose_errors, tilts_along_a_sine,
};
use closed_loop::{calibrate, figures, scattered};
use control_core::Calibration;
use mirror_model::{Model, Preset};
use virtual_mirror::{Family, MirrorConfig};

fn factory() -> Calibration {
    let model = Model::from(Preset::Reconciled);
    tabulate(&model).expect("a calibration").calibration
}

/// From the factory's calibration, by poses alone. What is required of tilts, a mirror of half a millimetre turns by with a
/// tenth of a micrometre at an edge.
#[test]
fn a_mirror_of_uneven_actuators_is_level_along_its_piston_and_goes_where_it_is_asked() {
    let config = scattered(MirrorConfig::draw(Family::F, 4711));
    let before = level_tilts(&factory(), &config, 6).expect("a mirror");
    let posed = calibrate_pose(&factory(), &config, 2).expect("a plate");
    println!(
        "left: {:.4} um, {:.5} deg",
        posed.piston_rms_um,
        posed.tilt_rms_rad.to_degrees()
    );
    let after = level_tilts(&posed.calibration, &config, 6).expect("a mirror");
    let (before, after) = (peak_to_peak_deg(&before), peak_to_peak_deg(&after));
    let errors = pose_errors(&posed.calibration, &config, 6, 0.8).expect("a mirror");
    println!("tilt along the piston {before:.4} deg before, {after:.4} after; {errors:?}");
    // docs/requirements.md
    assert!(after <= 0.005, "{after} deg, and {before} before");
    assert!(
        before > 10.0 * after,
        "{before} deg before are hardly scatter"
    );
    assert!(errors.tilt_rms_deg <= 0.005, "{errors:?}");
}

/// After its piston was calibrated, the paper's mirror, whose actuators differ most and share a frame that warms. What is required is
/// not reached there (docs/theory/pose.md, which has what is printed).
#[test]
#[ignore = "long"]
fn the_mirror_whose_actuators_differ_most_is_level_and_not_doubted() {
    let config = MirrorConfig::paper();
    let piston = calibrate(&config).expect("calibrated").calibration;
    let posed = calibrate_pose(&piston, &config, 2).expect("a plate");
    println!(
        "left: {:.4} um, {:.5} deg",
        posed.piston_rms_um,
        posed.tilt_rms_rad.to_degrees()
    );
    let figures = [with_assumed_levers(&piston), posed.calibration].map(|mut calibration| {
        let level = level_tilts(&calibration, &config, 6).expect("a mirror");
        let sine = tilts_along_a_sine(&calibration, &config, (60.0, 100.0), 20.0);
        let (sine, _) = sine.expect("a mirror");
        let level = peak_to_peak_deg(&level);
        println!(
            "tilt along the piston {level:.4} deg, along 20 Hz {:.4} deg; {:?}; {:?}",
            peak_to_peak_deg(&sine),
            pose_errors(&calibration, &config, 20, 0.8).expect("a mirror"),
            figures::at_rest(&mut calibration, &config).expect("a mirror"),
        );
        level
    });
    // docs/theory/pose.md
    assert!(60.0 * figures[1] < figures[0], "{figures:?}");
    let random = pose_errors(&posed.calibration, &config, 20, 0.8).expect("a mirror");
    assert!(random.tilt_rms_deg < 0.04, "{random:?}");
    let alarms = alarms(&posed.calibration, &config, 100, 0.8).expect("a mirror");
    assert_eq!(alarms, 0);
    // One that has aged is told all the same, before its piston is off by a micrometre.
    for (ageing, step) in [
        (Ageing::Resistance, 1e-3),
        (Ageing::Coefficient, -2e-3),
        (Ageing::Loss, 2e-2),
    ] {
        let course = Course {
            ageing,
            actuator: 3,
            step,
            room_k: 2.0,
        };
        let aged = aged(&mut posed.calibration.clone(), &config, &course).expect("a mirror");
        println!("{course:?} {aged:?}");
        assert!(aged.told_at.is_some() && aged.error_um < 1.0, "{aged:?}");
    }
}
