//! A mirror that friction holds off its rest is told where it is.

use closed_loop::calibrate_then;
use closed_loop::figures::next_moves;
use control_core::Setpoint;
use virtual_mirror::{Effect, MirrorConfig};

/// A minute, in ticks.
const MINUTE: usize = 600_000;

/// Dahl's friction with the paper's loop, 1.6 um wide: half of that is where it holds a mirror up that comes from above.
#[test]
#[ignore = "long"]
fn a_mirror_that_friction_holds_up_is_told_to_be_there() {
    let mut config = MirrorConfig::bench();
    config.effects.set(Effect::Hysteresis, 1.0);
    config.effects.set(Effect::Creep, 0.3);
    let (_, (first, rest)) = calibrate_then(&config, |mirror| {
        let first = next_moves(mirror);
        mirror.hold(150.0, 3.0);
        (0..MINUTE).for_each(|_| _ = mirror.tick(Setpoint::Off));
        (first, (mirror.mirror().state().z_um, mirror.told_um()))
    })
    .expect("a calibration");
    println!("first moves: {first:?}; at rest: {rest:?} um");
    let (true_um, told_um) = rest;
    assert!(true_um > 0.7, "friction holds it up: {true_um}");
    // What first moves after a calibration may be off by (docs/requirements.md).
    assert!((told_um - true_um).abs() < 0.15, "{told_um} for {true_um}");
    assert!(first.rms_um < 0.05 && first.largest_um < 0.15, "{first:?}");
}
