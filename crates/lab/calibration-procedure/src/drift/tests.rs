//! Checks of a mirror that disturbances move as they do.

use super::*;

/// A mirror of 360 ohm in a room so much warmer (K), in air that takes so many times the heat, under a sensor that has moved by so much (um) and reads a tilt as so large a part of the way.
fn check(warmer_k: f64, air: f64, sensor_um: f64, tilt: f64) -> DriftCheck {
    const COLD_OHM: f64 = 360.0;
    const LOSS_W_PER_K: f64 = 2.5e-4;
    const UM_PER_K: f64 = 1.7;
    /// By which the others show their resistance.
    const BIAS_V: f64 = 0.2;
    let mut file = MeasurementFile::default();
    // Of an actuator alone the plate goes a quarter of the way, and tilts as much more as its half width is of its levers' length.
    const ALONE: (f64, f64) = (0.25, 10.0);
    let levels = [
        (0.0, 4, 1),
        (3.5, 4, 1),
        (1.75, 4, 1),
        (0.35, 4, 1),
        (3.5, 1, 2),
        (0.0, 4, 20),
    ];
    for (drive_v, driven, seconds) in levels {
        // The power at a resistance that the power makes.
        let mut rise_k = 0.0;
        let ohm = |rise_k: f64| COLD_OHM * (1.0 + f64::from(FILM_TCR_PER_K) * (warmer_k + rise_k));
        for _ in 0..50 {
            rise_k = drive_v * drive_v / ohm(rise_k) / (air * LOSS_W_PER_K);
        }
        let (part, tilted) = if driven == 4 {
            (1.0, tilt)
        } else {
            (ALONE.0, ALONE.1 * tilt)
        };
        let way_um = UM_PER_K * (warmer_k + part * rise_k);
        let of_driven = |value: f64, of_others: f64| {
            std::array::from_fn(|i| if i < driven { value } else { of_others })
        };
        let row = Row {
            voltage_v: of_driven(drive_v, BIAS_V),
            current_a: of_driven(drive_v / ohm(rise_k), BIAS_V / COLD_OHM).map(Some),
            z_um: Some(sensor_um + (1.0 + tilted) * way_um),
            ..Row::default()
        };
        file.rows.extend(vec![row; seconds * CHECKED_READINGS]);
    }
    DriftCheck::of(&file)
}

fn against(now: &DriftCheck) -> Result<f64, Drift> {
    now.against(&check(0.0, 1.0, 0.0, 0.0))
}

#[test]
fn what_is_as_it_was_is_told_no_wider() {
    assert_eq!(against(&check(0.0, 1.0, 0.0, 0.0)), Ok(0.0));
    assert_eq!(against(&check(0.0, 1.0, 0.9 * USUAL_UM, 0.0)), Ok(0.0));
}

#[test]
fn what_has_moved_a_little_is_told_as_much_wider() {
    let moved_um = against(&check(0.0, 1.0, -0.5, 0.0)).expect("kept");
    assert!((moved_um - 0.5).abs() < 1e-9, "{moved_um}");
    // Half a kelvin.
    let moved_um = against(&check(0.5, 1.0, 0.0, 0.0)).expect("kept");
    assert!((0.7..1.0).contains(&moved_um), "{moved_um}");
}

#[test]
fn what_has_moved_far_is_called_by_its_name() {
    let stage = against(&check(0.0, 1.0, 2.0, 0.0));
    assert!(matches!(stage, Err(Drift::Moved { moved_um, .. }) if (moved_um - 2.0).abs() < 1e-9));
    // Less than that shows where all are driven alike.
    for tilt in [0.02, 0.004] {
        let spot = against(&check(0.0, 1.0, 0.0, tilt));
        assert!(
            matches!(spot, Err(Drift::Moved { drive_v: 3.5, moved_um }) if moved_um > 1.0),
            "{spot:?}"
        );
    }
    for kelvins in [2.0, -5.0] {
        let room = against(&check(kelvins, 1.0, 0.0, 0.0));
        // A line through the heaters' power and resistance is straight to a percent.
        assert!(
            matches!(room, Err(Drift::Room { warmer_k, .. }) if (warmer_k / kelvins - 1.0).abs() < 0.01),
            "{room:?}"
        );
    }
    for air in [0.85, 1.02, 1.2] {
        let air_is = against(&check(0.0, air, 0.0, 0.0));
        let percent = 100.0 * (air - 1.0);
        assert!(
            matches!(air_is, Err(Drift::Air { more_percent, .. }) if (more_percent - percent).abs() < 0.1),
            "{air_is:?}"
        );
    }
}

/// Sensors tell nothing now and then.
#[test]
fn a_reading_that_is_missing_or_wrong_is_no_matter() {
    let z_um = |read: [Option<f64>; 5]| {
        let rows = read.map(|z_um| Row {
            z_um,
            ..Row::default()
        });
        Level::of(&rows).z_um
    };
    let read = Some(2.0);
    assert_eq!(z_um([None, None, read, None, read]), read);
    assert_eq!(z_um([Some(9.0), read, read, Some(40.0), read]), read);
    assert_eq!(z_um([None; 5]), None);
}

/// A check of a mirror that rests there before and after.
fn resting(before_um: f64, after_um: f64) -> DriftCheck {
    let mut check = check(0.0, 1.0, 0.0, 0.0);
    check.levels[0].z_um = Some(before_um);
    check.levels[6].z_um = Some(after_um);
    check
}

#[test]
fn a_rest_is_where_the_mirror_comes_back_to() {
    for held_up_um in [0.0, 0.3, 0.8] {
        let check = resting(0.01, held_up_um);
        assert!(check.holds_still().is_ok() && check.comes_back());
    }
    let jump_um = |check: DriftCheck| match check.holds_still() {
        Err(Drift::Jump { jump_um }) => jump_um,
        other => panic!("{other:?}"),
    };
    // Nothing pulls it down.
    assert_eq!(jump_um(resting(0.0, -0.5)), -0.5);
    // It was moved after displacements were made to count from there.
    assert_eq!(jump_um(resting(0.5, 0.6)), 0.5);
    // Films that yield do so once.
    let yields = resting(0.0, 12.0);
    assert!(yields.holds_still().is_ok() && !yields.comes_back());
}

#[test]
fn films_that_relax_come_back_as_low_again() {
    let once = resting(0.01, -0.16);
    assert!(once.may_relax());
    assert!(resting(-0.12, -0.17).comes_back_as(&once).is_ok());
    // What was moved meanwhile is lower again, or as low as it was at first.
    for after_um in [-0.4, 0.0] {
        let again = resting(-0.12, after_um).comes_back_as(&once);
        assert!(matches!(again, Err(Drift::Jump { .. })), "{again:?}");
    }
    // Too far, and moved before anything was driven.
    assert!(!resting(0.0, -0.5).may_relax() && !resting(0.5, 0.3).may_relax());
}
