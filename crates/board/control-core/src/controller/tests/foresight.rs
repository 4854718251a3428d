use super::*;
use crate::design::TICK;

/// Follows `setpoint` for so many ticks with the currents of heaters that are as the calibration has them.
fn follow(controller: &mut Controller<'_>, setpoint: Setpoint, ticks: usize) {
    let mut applied = [Volt(0.0); CHANNELS];
    for _ in 0..ticks {
        applied = controller.step(setpoint, applied, NOTHING.1).drives;
        controller.foresee();
    }
}

#[test]
fn without_a_word_of_what_it_left_a_calibration_has_no_uncertainty() {
    let mut unknown = controller(Parts {
        residual: Residual::UNKNOWN,
        ..parts()
    });
    follow(&mut unknown, Setpoint::position(Micrometre(50.0)), 200);
    assert_eq!((unknown.uncertainty(), unknown.settles_in()), (None, None));
    let untried = Residual {
        tried: Micrometre(0.0),
        part: 0.03,
        ..parts().residual
    };
    let mut untried = controller(Parts {
        residual: untried,
        ..parts()
    });
    follow(&mut untried, Setpoint::position(Micrometre(50.0)), 200);
    assert!(untried.uncertainty().expect("known").z.0 > 1.96 * 0.03 * 50.0);
    assert_eq!(untried.settles_in(), None);
}

/// An instant mirror of which nothing but hysteresis is unknown, which never lets go.
fn of_friction() -> Parts {
    Parts {
        actuators: [actuator(170.0, 97.0); CHANNELS],
        heat: Heat::INSTANT,
        memory: Memory {
            creep: Memory::NONE.creep,
            release: Second(0.0),
            ..parts().memory
        },
        residual: Residual {
            piston: Micrometre(1e-3),
            tried: Micrometre(170.0),
            ..Residual::UNKNOWN
        },
        ..parts()
    }
}

/// Nothing but hysteresis is unknown of this mirror in a room that nobody asks about: once its play operators were pulled all the
/// way they are where the controller has them.
#[test]
fn what_the_mirror_remembers_is_known_once_it_was_moved_all_the_way() {
    let mut one = controller(of_friction());
    one.compensate_surroundings(true);
    let uncertain_um = |controller: &mut Controller<'_>, z: f32| {
        follow(controller, Setpoint::position(Micrometre(z)), 400);
        let [plays, ..] = controller.budget.spans();
        plays.iter().map(|(low, high)| high - low).sum::<f32>()
    };
    let first_um = uncertain_um(&mut one, 5.0);
    assert!(first_um > 40.0, "{first_um}");
    assert_eq!(uncertain_um(&mut one, 160.0), 0.0);
    assert_eq!(uncertain_um(&mut one, 5.0), 0.0);
}

/// Currents of a heater of 100 ohm, of which nothing can be told.
#[test]
fn what_no_resistance_vouches_for_may_be_a_micrometre_off() {
    let told_um = |ohm: f32| {
        let mut one = controller(parts());
        let mut drives = NOTHING.0;
        for _ in 0..5_000 {
            let currents = drives.map(|drive| Ampere(drive.0 / ohm));
            drives = one
                .step(Setpoint::position(Micrometre(80.0)), drives, currents)
                .drives;
            one.foresee();
        }
        let is_unknown = one.step.limits.contains(Limit::ResistanceUnknown);
        (one.uncertainty().expect("it is known").z.0, is_unknown)
    };
    let ((silent_um, is_silent), (wrong_um, is_wrong)) = (told_um(f32::INFINITY), told_um(100.0));
    assert!(!is_silent && is_wrong);
    // 1.96 times 1 um over the root of 3.
    let more_um = (wrong_um * wrong_um - silent_um * silent_um).sqrt();
    assert!(
        (more_um - 1.96 / 3.0_f32.sqrt()).abs() < 0.05,
        "{silent_um} and {wrong_um}"
    );
}

/// A move of nothing but its path, and one that has to wait until heat has flowed off.
#[test]
fn a_move_is_settled_when_its_path_is_over_and_the_heat_is_there() {
    let mut quick = parts();
    quick.ambient_ratio = 0.0;
    let path_ticks = (quick.path.move_time.0 / TICK.0) as usize;
    let mut mirror = controller(quick);
    let settled_after = |mirror: &mut Controller<'_>, z: f32| {
        let setpoint = Setpoint::position(Micrometre(z));
        let is_settled = |mirror: &mut Controller<'_>| {
            follow(mirror, setpoint, 1);
            mirror.settles_in() == Some(Second(0.0))
        };
        (1..20_000)
            .find(|_| is_settled(mirror))
            .expect("it settles")
    };
    follow(&mut mirror, Setpoint::position(Micrometre(60.0)), 5_000);
    // Each actuator is looked at once in 16 ticks.
    let quick_ticks = settled_after(&mut mirror, 62.0);
    assert!(
        (path_ticks..=path_ticks + PERIOD).contains(&quick_ticks),
        "{quick_ticks}"
    );
    follow(&mut mirror, Setpoint::position(Micrometre(160.0)), 5_000);
    // The first that is looked at knows of the others' heating a round later.
    follow(
        &mut mirror,
        Setpoint::position(Micrometre(40.0)),
        2 * PERIOD,
    );
    let foreseen_s = mirror.settles_in().expect("a position").0;
    let took_s = settled_after(&mut mirror, 40.0) as f32 * TICK.0;
    // 0.4 of the heat have 35 ms and more; the loss grows with what is foreseen at the target.
    assert!(
        took_s > 0.03 && (foreseen_s / took_s - 1.0).abs() < 0.3,
        "{foreseen_s} and {took_s} s"
    );
    follow(&mut mirror, Setpoint::Off, 1);
    assert_eq!(mirror.settles_in(), None);
}

/// Friction that never lets go: from above it holds each actuator of an instant mirror up where 0 is asked for.
#[test]
fn what_friction_holds_up_does_not_settle() {
    let mut one = controller(Parts {
        ambient_ratio: 0.0,
        sensed_crosstalk: 0.0,
        ..of_friction()
    });
    let mut settles_at = |z: f32| {
        follow(&mut one, Setpoint::position(Micrometre(z)), 2_000);
        one.settles_in()
    };
    assert_eq!(settles_at(0.0), Some(Second(0.0)), "before it was moved");
    assert_eq!(settles_at(160.0), Some(Second(0.0)));
    assert_eq!(settles_at(0.0), None);
    assert_eq!(settles_at(20.0), Some(Second(0.0)));
}

/// Level, the actuators warm each other, and the highest drive takes them all there; tilted, the hottest stays short of what its poles say.
#[test]
fn what_the_bounds_hold_short_does_not_settle() {
    let mut parts = Parts {
        ambient_ratio: 0.0,
        memory: Memory::NONE,
        ..parts()
    };
    parts.bounds.drive = Volt(3.2);
    let lever = parts.plate.levers[0].x.0;
    let mut mirror = controller(parts);
    let mut settles_at = |z: f32, highest: f32| {
        let pose = Pose {
            z: Micrometre(z),
            tilt_x: Radian(0.0),
            tilt_y: Radian((z - highest) / lever),
        };
        follow(&mut mirror, Setpoint::Position(pose), 60_000);
        (mirror.settles_in(), mirror.latest().limits)
    };
    assert_eq!(settles_at(160.0, 160.0), (Some(Second(0.0)), Limits::NONE));
    let (settles, limits) = settles_at(95.0, 160.0);
    assert_eq!(settles, None);
    assert!(limits.contains(Limit::DriveHigh), "{limits:?}");
    assert_eq!(settles_at(95.0, 130.0), (Some(Second(0.0)), Limits::NONE));
}
