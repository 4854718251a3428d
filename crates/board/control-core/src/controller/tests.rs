use super::*;
use crate::calibration::tests::parts;
use crate::calibration::{ActuatorCalibration, Heat, Memory, Residual, SensedRises};
use crate::shape::{InverseTable, KNOTS};
use crate::units::{Kelvin, KelvinPerWatt, Ohm, PerKelvin, Second};
use proptest::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

/// Ticks of ten seconds.
const TEN_SECONDS: u32 = 100_000;

#[test]
fn a_controller_at_rest_is_the_same_however_long_it_has_been() {
    let mut calibration = Box::new(Calibration::new(parts()).expect("good"));
    let mut controller = Controller::new(&mut calibration);
    assert!(controller.is_at_rest(), "before anything was driven");
    let mut applied = [Volt(0.0); CHANNELS];
    let mut follow = |controller: &mut Controller<'_>, setpoint, ticks: u32| {
        for _ in 0..ticks {
            let step = controller.step(setpoint, applied, [Ampere(0.0); CHANNELS]);
            applied = step.drives;
        }
        applied[0].0
    };
    let there = Setpoint::position(Micrometre(40.0));
    follow(&mut controller, there, 20_000);
    assert!(!controller.is_at_rest(), "it is warm");
    let mut waited = 0;
    while !controller.is_at_rest() {
        follow(&mut controller, Setpoint::Off, TEN_SECONDS);
        waited += 1;
        assert!(waited < 1000, "it never comes to rest");
    }
    let actuators = controller.actuators.clone();
    let soon = follow(&mut controller, there, 5_000);
    controller.actuators = actuators;
    follow(&mut controller, Setpoint::Off, 10 * TEN_SECONDS);
    let late = follow(&mut controller, there, 5_000);
    // 1 um is some 10 mV there, and what is left is 2 nm at most of creep and heat.
    assert!((soon - late).abs() < 1e-4, "{soon} and {late}");
}

/// In the midst of a course, warm and with a history.
#[test]
fn a_calibration_that_is_exchanged_for_itself_changes_nothing() {
    let course = |exchanged_at: u32| {
        let calibration = || Box::leak(Box::new(Calibration::new(parts()).expect("good")));
        let mut controller = Controller::new(calibration());
        for tick in 0..40_000 {
            if tick == exchanged_at {
                controller.exchange(calibration());
            }
            let z = Micrometre([90.0, 20.0, 60.0, 40.0][tick as usize / 10_000]);
            controller.step(Setpoint::position(z), NOTHING.0, NOTHING.1);
        }
        (controller.step.drives, controller.budget.spans())
    };
    let ((drives, spans), (exchanged, spans_then)) = (course(u32::MAX), course(25_000));
    for (drive, other) in drives.into_iter().zip(exchanged) {
        // 1 um is some 10 mV there: a nanometre.
        assert!((drive.0 - other.0).abs() < 1e-5, "{drive:?} and {other:?}");
    }
    for ((low, high), (other_low, other_high)) in spans
        .into_iter()
        .flatten()
        .zip(spans_then.into_iter().flatten())
    {
        assert!((low - other_low).abs() + (high - other_high).abs() < 1e-3);
    }
}

/// A stage in each tick, as the firmware does it while nothing is driven.
#[test]
fn a_calibration_that_is_exchanged_stage_by_stage_changes_nothing() {
    let course = |is_exchanged: bool| {
        let calibration = || Box::leak(Box::new(Calibration::new(parts()).expect("good")));
        let mut controller = Controller::new(calibration());
        let tick = |controller: &mut Controller, setpoint| {
            controller.step(setpoint, NOTHING.0, NOTHING.1).drives
        };
        let moved = |controller: &mut Controller, z_um: f32| {
            let moved = (0..5_000).map(|_| tick(controller, Setpoint::position(Micrometre(z_um))));
            moved.last().expect("ticks")
        };
        moved(&mut controller, 90.0);
        moved(&mut controller, 40.0);
        let mut stages = 0;
        if is_exchanged {
            controller.begin_exchange(calibration());
        }
        for _ in 0..20 {
            tick(&mut controller, Setpoint::Off);
            if controller.is_exchanging() {
                controller.exchange_on();
                stages += 1;
            }
        }
        assert!(!controller.is_exchanging());
        assert_eq!(stages > 1, is_exchanged);
        moved(&mut controller, 60.0)
    };
    for (drive, exchanged) in course(false).into_iter().zip(course(true)) {
        // 1 um is some 10 mV there: 10 nm, for the creep of the ticks in which memory stands still.
        assert!(
            (drive.0 - exchanged.0).abs() < 1e-4,
            "{drive:?} and {exchanged:?}"
        );
    }
}

/// 100 um at 100 K, 400 ohm cold, 560 ohm at the top; nothing takes time.
fn static_parts() -> Parts {
    let actuator = ActuatorCalibration {
        cold_resistance: Ohm(400.0),
        tcr: PerKelvin(0.004),
        thermal_resistance: KelvinPerWatt(5000.0),
        loss_growth: PerKelvin(0.0),
        shape: InverseTable::new(
            Micrometre(100.0),
            core::array::from_fn(|i| 100.0 * i as f32 / (KNOTS - 1) as f32),
        )
        .expect("rising"),
        sensed_rises: SensedRises::UNKNOWN,
    };
    Parts {
        actuators: [actuator; CHANNELS],
        heat: Heat::INSTANT,
        memory: Memory::NONE,
        ambient_ratio: 0.0,
        ..parts()
    }
}

fn controller(parts: Parts) -> Controller<'static> {
    let calibration = Calibration::new(parts).expect("plausible");
    Controller::new(Box::leak(Box::new(calibration)))
}

const NOTHING: ([Volt; CHANNELS], [Ampere; CHANNELS]) =
    ([Volt(0.0); CHANNELS], [Ampere(0.0); CHANNELS]);

fn step(setpoint: Setpoint) -> Step {
    *controller(static_parts()).step(setpoint, NOTHING.0, NOTHING.1)
}

#[test]
fn a_position_is_driven_with_the_power_that_holds_it() {
    let drive = step(Setpoint::track(Micrometre(50.0))).drives[0].0;
    // 50 K need 10 mW; the heater has 400 ohm still.
    assert!((drive - (10e-3_f32 * 400.0).sqrt()).abs() < 1e-5, "{drive}");
    let mut controller = controller(static_parts());
    let mut settled = |z| {
        let tick = |_| *controller.step(Setpoint::position(Micrometre(z)), NOTHING.0, NOTHING.1);
        (0..100).map(tick).last().expect("ticks").drives[0].0
    };
    assert!((settled(50.0) - (10e-3_f32 * 480.0).sqrt()).abs() < 1e-5);
    assert_eq!(settled(0.0), 0.0);
}

#[test]
fn a_position_out_of_range_is_limited_by_name() {
    let limited = |z| step(Setpoint::position(Micrometre(z))).limits;
    assert_eq!(limited(50.0), Limits::NONE);
    assert!(limited(100.1).contains(Limit::PositionHigh));
    assert!(limited(-0.1).contains(Limit::PositionLow));
    assert!(limited(f32::NAN).contains(Limit::NotANumber));
}

#[test]
fn a_drive_above_the_highest_is_limited_by_name() {
    let mut drives = [Volt(1.0); CHANNELS];
    drives[2] = Volt(3.6);
    let step = step(Setpoint::Drive(drives));
    assert_eq!(step.drives[2], Volt(3.5));
    assert_eq!(step.codes[2], PwmCode(3500));
    assert_eq!(step.drives[1], Volt(1.0));
    assert!(step.limits.contains(Limit::DriveHigh));
}

#[test]
fn power_and_temperature_are_limited_by_name() {
    let limited = |change: fn(&mut Parts)| {
        let mut parts = static_parts();
        change(&mut parts);
        let setpoint = Setpoint::track(Micrometre(60.0));
        *controller(parts).step(setpoint, NOTHING.0, NOTHING.1)
    };
    let power = limited(|parts| parts.bounds.power = crate::units::Watt(6e-3));
    assert!(power.limits.contains(Limit::PowerHigh));
    assert!((power.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
    let rise = limited(|parts| parts.bounds.rise = Kelvin(30.0));
    assert!(rise.limits.contains(Limit::TemperatureHigh));
    assert!((rise.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
}

#[test]
fn a_mirror_that_cannot_cool_faster_says_so() {
    let mut controller = controller(parts());
    controller.compensate_surroundings(false);
    let mut last = |z: f32, ticks: usize| {
        let tick = |_| *controller.step(Setpoint::position(Micrometre(z)), NOTHING.0, NOTHING.1);
        (0..ticks).map(tick).last().expect("ticks")
    };
    last(150.0, 10_000);
    let cooling = last(10.0, 60);
    assert!(cooling.limits.contains(Limit::Cooling));
    assert_eq!(cooling.codes, [PwmCode(0); CHANNELS]);
    assert_eq!(last(10.0, 20_000).limits, Limits::NONE);
}

#[test]
fn what_a_bound_held_back_catches_up_without_a_jerk() {
    // What actuators share is told them once in four ticks, by up to 0.04 K here.
    let mut parts = parts();
    parts.heat.shared = Heat::INSTANT.shared;
    let mut controller = controller(parts);
    let mut ticks = |z: f32, ticks: usize| -> Vec<(f32, bool)> {
        let mut tick = |_| {
            let setpoint = Setpoint::position(Micrometre(z));
            let limits = controller.step(setpoint, NOTHING.0, NOTHING.1).limits;
            (
                controller.actuators[0].rise().0,
                limits.contains(Limit::Cooling),
            )
        };
        (0..ticks).map(&mut tick).collect()
    };
    ticks(170.0, 10_000);
    let fall = ticks(50.0, 1000);
    let last = fall.iter().rposition(|(_, cooling)| *cooling);
    let last = last.expect("it was held back");
    // The last tick that was held back, and the three after it.
    let speed = |tick: usize| fall[tick - 1].0 - fall[tick].0;
    for tick in last..last + 3 {
        let left = speed(tick + 1) / speed(tick);
        assert!(left > 0.7, "{left} of the speed is left after a tick");
    }
}

#[test]
fn the_current_is_read_as_a_thermometer() {
    let currents = [
        Ampere(2.0 / 480.0),
        Ampere(2.0 / 400.0),
        Ampere(0.0),
        Ampere(-1e-6),
    ];
    let mut controller = controller(static_parts());
    // One actuator has its turn at each tick.
    for _ in 1..CHANNELS {
        controller.step(Setpoint::Off, [Volt(2.0); CHANNELS], currents);
    }
    let step = controller.step(Setpoint::Off, [Volt(2.0); CHANNELS], currents);
    let rises = step
        .sense
        .map(|actuator| actuator.map(|actuator| actuator.temperature_rise.0.round()));
    assert_eq!(rises, [Some(50.0), Some(0.0), None, None]);
}

#[test]
fn a_heater_of_another_resistance_gets_the_same_power() {
    let mut controller = controller(static_parts());
    let ohm = 1.1 * 480.0;
    let mut applied = [Volt(0.0); CHANNELS];
    for _ in 0..200 {
        let currents = applied.map(|drive| Ampere(drive.0 / ohm));
        let setpoint = Setpoint::position(Micrometre(50.0));
        applied = controller.step(setpoint, applied, currents).drives;
    }
    let power = applied[0].0 * applied[0].0 / ohm;
    assert!((power - 10e-3).abs() < 1e-6, "{power}");
}

#[test]
fn an_implausible_current_is_named_and_not_used() {
    let mut controller = controller(static_parts());
    let setpoint = Setpoint::track(Micrometre(50.0));
    let mut applied = [Volt(0.0); CHANNELS];
    let mut told = false;
    for current in [40e-3, 1e-5].into_iter().cycle().take(100) {
        let step = controller.step(setpoint, applied, [Ampere(current); CHANNELS]);
        told |= step.limits.contains(Limit::ResistanceUnknown);
        applied = step.drives;
    }
    assert!(told);
    assert!((applied[0].0 - (10e-3_f32 * 480.0).sqrt()).abs() < 1e-5);
}

fn any_float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

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

/// Nothing but hysteresis is unknown of this mirror in a room that nobody asks about: once its play operators were pulled all the
/// way they are where the controller has them.
#[test]
fn what_the_mirror_remembers_is_known_once_it_was_moved_all_the_way() {
    let mut one = controller(Parts {
        heat: Heat::INSTANT,
        memory: Memory {
            creep: Memory::NONE.creep,
            release: Second(0.0),
            ..parts().memory
        },
        residual: Residual {
            piston: Micrometre(1e-3),
            ..Residual::UNKNOWN
        },
        ..parts()
    });
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
    // It was tried.
    quick.residual.part = 0.0;
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
    follow(&mut mirror, Setpoint::position(Micrometre(40.0)), 16);
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

fn any_setpoint() -> impl Strategy<Value = Setpoint> {
    prop_oneof![
        Just(Setpoint::Off),
        any_float().prop_map(|z| Setpoint::position(Micrometre(z))),
        (0.0_f32..200.0).prop_map(|z| Setpoint::position(Micrometre(z))),
        any_float().prop_map(|z| Setpoint::track(Micrometre(z))),
        proptest::array::uniform4(any_float()).prop_map(|v| Setpoint::Drive(v.map(Volt))),
    ]
}

proptest! {
    /// And it recovers: whatever came before, a position is driven in the end.
    #[test]
    fn any_bit_pattern_gives_a_drive_within_the_limits(
        ticks in proptest::collection::vec((
            any_setpoint(),
            proptest::array::uniform4(any_float()),
            proptest::array::uniform4(any_float()),
        ), 1..30),
    ) {
        let mut controller = controller(parts());
        for (setpoint, applied, currents) in ticks {
            let step = *controller.step(setpoint, applied.map(Volt), currents.map(Ampere));
            controller.foresee();
            let told = controller.uncertainty().expect("the calibration says what it left");
            prop_assert!(told.z.0 >= 0.0 && told.tilt.0 >= 0.0, "{told:?}");
            for (drive, code) in step.drives.into_iter().zip(step.codes) {
                prop_assert!((0.0..=3.5).contains(&drive.0), "{drive:?}");
                prop_assert!(code.0 <= 3500);
            }
        }
        let setpoint = Setpoint::position(Micrometre(100.0));
        let tick = |_| controller.step(setpoint, NOTHING.0, NOTHING.1).drives[0].0;
        let settled = (0..3000).map(tick).last().expect("ticks");
        prop_assert!((1.0..3.0).contains(&settled), "{settled}");
    }

    #[test]
    fn a_higher_position_never_needs_a_lower_drive(a in 0.0_f32..100.0, b in 0.0_f32..100.0) {
        let drive = |z| step(Setpoint::track(Micrometre(z))).drives[0];
        prop_assert!(drive(a.min(b)) <= drive(a.max(b)));
    }
}
