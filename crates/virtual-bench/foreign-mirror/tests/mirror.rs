//! What a mirror does that can be told by hand, and that one seed is one mirror.

use foreign_mirror::{ForeignConfig, ForeignMirror};

fn still() -> ForeignConfig {
    ForeignConfig {
        scatter: 0.0,
        friction: 0.0,
        creep: 0.0,
        ..ForeignConfig::new(1)
    }
}

#[test]
fn even_actuators_hold_the_plate_level_and_a_weak_one_does_not() {
    let tilt = |weakness: f64| {
        let mut mirror = ForeignMirror::new(&ForeignConfig {
            weakness,
            ..still()
        });
        mirror.step([2.5; 4], 1.0);
        mirror.tilts_deg().map(f64::abs)
    };
    assert!(tilt(0.0).iter().all(|deg| *deg < 1e-9));
    let [x, y] = tilt(0.2);
    // A fifth of some 100 um over a millimetre: one degree, about one axis.
    assert!(
        (0.7..1.5).contains(&x.max(y)) && x.min(y) < 1e-9,
        "{x} and {y}"
    );
}

#[test]
fn a_room_bends_like_a_heater_and_shows_in_the_resistance() {
    let mut mirror = ForeignMirror::new(&still());
    mirror.set_ambient(10.0);
    mirror.step([0.01; 4], 1.0);
    // 600 um, 0.022 rad, at the cosine of 0.3 rad.
    assert!((mirror.z_um() - 12.7).abs() < 0.3, "{}", mirror.z_um());
    let ohm = 0.01 / mirror.current_a()[0];
    assert!((ohm - (10.0 + 330.0 * 1.03)).abs() < 0.2, "{ohm}");
}

#[test]
fn slower_mirrors_take_longer_and_go_as_far() {
    let way = |slowness: f64, seconds: f64| {
        let mut mirror = ForeignMirror::new(&ForeignConfig {
            slowness,
            ..still()
        });
        mirror.step([2.5; 4], seconds);
        mirror.z_um()
    };
    // The substrate is what it is, and hardly begins to warm.
    assert!((way(0.5, 0.02) - way(5.0, 0.2)).abs() < 0.5);
    assert!(way(5.0, 0.02) < 0.5 * way(0.5, 0.02));
}

#[test]
fn a_seed_is_a_mirror_and_no_drive_a_hazard() {
    let course = |seed: u64| {
        let mut mirror = ForeignMirror::new(&ForeignConfig::new(seed));
        mirror.step([f64::NAN, 3.0, -2.0, f64::INFINITY], 0.1);
        mirror.step([2.0; 4], 0.1);
        mirror.z_um()
    };
    assert!(course(3).is_finite());
    assert_eq!(course(3).to_bits(), course(3).to_bits());
    assert!((course(3) - course(4)).abs() > 0.01);
}
