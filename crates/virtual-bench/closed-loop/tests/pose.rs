//! Poses on mirrors that nothing was developed on: tilt along the piston, and poses that are asked for.

use std::thread;

use calibration::{tabulate, with_assumed_levers};
use closed_loop::drift::{Ageing, Course, aged};
use closed_loop::pose::{
    PoseErrors, ReachedPose, alarms, calibrate_pose, edge_poses, level_tilts, peak_to_peak_deg,
    random_poses, tilts_along_a_sine,
};
use closed_loop::surroundings::Around;
use closed_loop::{calibrate, figures, scattered, usual_mirror};
use control_core::{Calibration, Limit};
use mirror_model::{Model, Preset};
use virtual_mirror::{Family, MirrorConfig};

fn factory() -> Calibration {
    let model = Model::from(Preset::Reconciled);
    tabulate(&model).expect("a calibration").calibration
}

/// What random poses are off by where the calibration was made.
fn errors_at_random(
    calibration: &Calibration,
    config: &MirrorConfig,
    poses: (usize, f64),
) -> PoseErrors {
    let reached = random_poses(calibration, config, poses, Around::CALIBRATION);
    PoseErrors::of(&reached.expect("a mirror"))
}

/// From the factory's calibration, by poses alone. What is required of tilts, a mirror of half a millimetre turns by with a
/// tenth of a micrometre at an edge.
#[test]
#[ignore = "long"]
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
    let errors = errors_at_random(&posed.calibration, &config, (6, 0.8));
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
            errors_at_random(&calibration, &config, (20, 0.8)),
            figures::at_rest(&mut calibration, &config).expect("a mirror"),
        );
        level
    });
    // docs/theory/pose.md
    assert!(60.0 * figures[1] < figures[0], "{figures:?}");
    let random = errors_at_random(&posed.calibration, &config, (20, 0.8));
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

/// Next to the edge of what is held, where the four are least alike warm.
#[test]
#[ignore = "long"]
fn an_actuator_that_bends_less_is_not_doubted_at_the_edge() {
    let mut paper = MirrorConfig::paper();
    paper.trim.bend[2] = 0.8;
    let mut other = scattered(usual_mirror(Family::E, 886));
    other.trim.bend[3] = 0.85;
    let alarms = [paper, other].map(|config| {
        let piston = calibrate(&config).expect("calibrated").calibration;
        let posed = calibrate_pose(&piston, &config, 2).expect("a plate");
        let reached = edge_poses(&posed.calibration, &config, (2, 0.9), Around::CALIBRATION);
        let reached = reached.expect("a mirror");
        let told = |pose: &&ReachedPose| pose.limits.contains(Limit::CalibrationDrifted);
        let alarms = reached.iter().filter(told).count();
        println!("{}: {alarms} of {}", config.name, reached.len());
        alarms
    });
    assert_eq!(alarms, [0, 0]);
}

/// Rooms and air that are others than at calibration.
const ELSEWHERE: [Around; 5] = [
    around(0.0, 1.1),
    around(0.0, 0.85),
    around(9.0, 1.0),
    around(-11.0, 1.0),
    around(-6.0, 1.15),
];

const fn around(rise_k: f64, air: f64) -> Around {
    Around { rise_k, air }
}

/// Poses in other rooms and other air: each heater's own resistance tells what its actuator makes of them, so tilts stay within what is told, and
/// no mirror is taken for another.
#[test]
#[ignore = "long"]
fn poses_elsewhere_are_within_what_is_told() {
    let usual = |family, seed| scattered(usual_mirror(family, seed));
    let mirrors = [
        MirrorConfig::paper(),
        usual(Family::A, 811),
        usual(Family::C, 812),
        usual(Family::D, 813),
        usual(Family::E, 814),
        usual(Family::G, 815),
    ];
    let poses_of = |config: &MirrorConfig| {
        let piston = calibrate(config).expect("calibrated").calibration;
        let posed = calibrate_pose(&piston, config, 2).expect("a plate");
        let elsewhere = ELSEWHERE.map(|around| {
            let reached = random_poses(&posed.calibration, config, (20, 0.8), around);
            let reached = reached.expect("a mirror");
            println!(
                "{} {around:?}: {:?}, missed {}",
                config.name,
                PoseErrors::of(&reached),
                missed(&reached),
            );
            reached
        });
        elsewhere.concat()
    };
    let poses: Vec<_> = thread::scope(|scope| {
        let threads = mirrors
            .each_ref()
            .map(|config| scope.spawn(move || poses_of(config)));
        threads
            .map(|thread| thread.join().expect("measured"))
            .concat()
    });
    let (missed, told) = (
        missed(&poses),
        poses.iter().filter(|pose| is_held(pose)).count(),
    );
    let alarms = poses
        .iter()
        .filter(|pose| pose.limits.contains(Limit::CalibrationDrifted));
    println!("missed {missed} of {told}");
    assert_eq!(alarms.count(), 0);
    // 95 +- 2 % is required of intervals (docs/requirements.md), of a pose's two tilts together as of one.
    assert!(missed as f64 <= 0.07 * told as f64, "{missed} of {told}");
}

/// What `host-tool range` tells is held, in the room of the calibration and in others, and no more of what is held is left out than a twentieth
/// of the tilts.
#[test]
#[ignore = "long"]
fn poses_on_the_edge_that_is_told_are_held() {
    let usual = |family, seed| scattered(usual_mirror(family, seed));
    let mirrors = [
        MirrorConfig::paper(),
        usual(Family::A, 856),
        usual(Family::C, 857),
        usual(Family::D, 858),
        usual(Family::E, 859),
        usual(Family::G, 860),
    ];
    /// Parts of the largest tilts: within the edge and beyond it.
    const WITHIN: f64 = 0.98;
    const BEYOND: f64 = 1.05;
    let counts_of = |config: &MirrorConfig| {
        let piston = calibrate(config).expect("calibrated").calibration;
        let posed = calibrate_pose(&piston, config, 2).expect("a plate");
        let count = |every: usize, part: f64, around: Around| {
            let reached = edge_poses(&posed.calibration, config, (every, part), around);
            let reached = reached.expect("a mirror");
            let elsewhere = reached.iter().filter(|pose| !is_held(pose)).count();
            println!(
                "{} {part} of the edge, {around:?}: {elsewhere} of {} are held elsewhere",
                config.name,
                reached.len()
            );
            [elsewhere, reached.len()]
        };
        let others = [ELSEWHERE[2], ELSEWHERE[3]].map(|around| count(7, WITHIN, around));
        [
            count(2, WITHIN, Around::CALIBRATION),
            count(7, BEYOND, Around::CALIBRATION),
            sum(&others),
        ]
    };
    let counts: Vec<_> = thread::scope(|scope| {
        let threads = mirrors
            .each_ref()
            .map(|config| scope.spawn(move || counts_of(config)));
        Vec::from(threads.map(|thread| thread.join().expect("measured")))
    });
    let of_all = |which: usize| {
        sum(&counts
            .iter()
            .map(|counts| counts[which])
            .collect::<Vec<_>>())
    };
    let [within, beyond, others] = [of_all(0), of_all(1), of_all(2)];
    println!("within {within:?}, beyond {beyond:?}, in other rooms {others:?}");
    assert!(50 * within[0] <= within[1], "{within:?}");
    assert!(20 * others[0] <= others[1], "{others:?}");
    assert!(4 * beyond[0] >= 3 * beyond[1], "{beyond:?}");
}

fn sum(counts: &[[usize; 2]]) -> [usize; 2] {
    counts
        .iter()
        .fold([0, 0], |sum, count| [sum[0] + count[0], sum[1] + count[1]])
}

fn is_held(pose: &ReachedPose) -> bool {
    !pose.limits.hold_back()
}

/// Poses whose tilts are off by more than was told.
fn missed(poses: &[ReachedPose]) -> usize {
    let held = poses.iter().filter(|pose| is_held(pose));
    held.filter(|pose| pose.is_tilt_missed()).count()
}
