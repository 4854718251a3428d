//! The core's f32 arithmetic against the same chain in f64. `cargo xtask bench position` measures the same on mirrors
//! that were calibrated from what was measured of them.

use calibration::tabulate;
use closed_loop::precision;
use control_core::Calibration;
use mirror_model::effect::{Active, find};
use mirror_model::{Model, Preset, Symbol};
use virtual_mirror::MirrorConfig;

/// What f32 may make of a position.
const BOUND_UM: f64 = 5e-3;
/// What it may make of the drive of a single tick: a pole of 5 ms follows a fiftieth of it, and its inverse multiplies
/// roundings by as much.
const DRIVE_BOUND_UM: f64 = 50e-3;

/// Effects of every stage in time, and poles: fastest, middle, and the middle one's weight.
fn model((fast_s, middle_s, middle): (f64, f64, f64), effects: &[&str]) -> Model {
    let mut model = Model::from(Preset::Reconciled);
    for (symbol, value) in [
        (Symbol::FastTime, fast_s),
        (Symbol::MiddleTime, middle_s),
        (Symbol::MiddleWeight, middle),
    ] {
        model.parameters.set(symbol, value);
    }
    let effects = effects.iter().map(|id| find(id).expect("an effect"));
    model.effects.extend(effects.map(Active::usual));
    model
}

#[test]
#[ignore = "long"]
fn f32_is_as_good_as_f64_along_minutes_of_motion() {
    let all = [
        "heat-loss-temperature",
        "substrate-warming",
        "hysteresis",
        "creep",
    ];
    let models = [
        model((0.6e-3, 0.03, 0.4), &all),
        model((5e-3, 0.15, 0.1), &all),
        model((5e-3, 0.04, 0.2), &[]),
    ];
    let calibrations = models.map(|model| tabulate(&model).expect("a calibration").calibration);
    // What a frame makes of the first one.
    let mut shared = *calibrations[0].parts();
    shared.heat.shared = [0.0, 0.9, 0.0, 0.8, 0.0];
    let shared = Calibration::new(shared).expect("poles of 30 ms and of seconds");
    for (seed, mut calibration) in (1..).zip(calibrations.into_iter().chain([shared])) {
        let config = MirrorConfig::bench();
        let worst = precision(&mut calibration, &config, 60.0, seed).expect("a mirror");
        println!("calibration {seed}: {worst:?}");
        assert!(worst.mirror_um <= BOUND_UM, "{seed}: {worst:?}");
        assert!(worst.drive_um <= DRIVE_BOUND_UM, "{seed}: {worst:?}");
        // They are two computations.
        assert!(worst.mirror_um > 0.0);
    }
}
