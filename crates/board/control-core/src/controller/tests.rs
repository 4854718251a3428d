use super::*;
use crate::calibration::tests::{actuator, parts};
use crate::calibration::{
    ActuatorCalibration, Heat, Memory, Path, Residual, Resonance, SensedRises,
};
use crate::shape::{InverseTable, KNOTS};
use crate::units::{Kelvin, KelvinPerWatt, Ohm, PerKelvin, Second};
use proptest::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

mod exchange;
mod foresight;
mod retained;

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

/// 100 um at 100 K, 400 ohm cold, 560 ohm at the top; nothing takes time.
fn static_parts() -> Parts {
    let actuator = ActuatorCalibration {
        cold_resistance: Ohm(400.0),
        tcr: PerKelvin(0.004),
        thermal_resistance: KelvinPerWatt(5000.0),
        loss_growth: PerKelvin(0.0),
        slower_by: Second(0.0),
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
        path: Path {
            resonance: Resonance::UNKNOWN,
            ..parts().path
        },
        ambient_ratio: 0.0,
        sensed_crosstalk: 0.0,
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
    // A thousandth of a code: of slow poles that it lacks it follows what they would be.
    assert!(settled(0.0) < 1e-6);
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
    // A hundredth of a drive's step of 1 mV.
    assert!((power.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
    let rise = limited(|parts| parts.bounds.rise = Kelvin(30.0));
    assert!(rise.limits.contains(Limit::TemperatureHigh));
    // As above.
    assert!((rise.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
}

/// The last of so many steps at a position.
fn asked_for(controller: &mut Controller<'_>, z: f32, ticks: usize) -> Step {
    let tick = |_| *controller.step(Setpoint::position(Micrometre(z)), NOTHING.0, NOTHING.1);
    (0..ticks).map(tick).last().expect("ticks")
}

#[test]
fn a_mirror_that_cannot_cool_faster_says_so() {
    let mut controller = controller(parts());
    controller.compensate_surroundings(false);
    let mut last = |z, ticks| asked_for(&mut controller, z, ticks);
    last(150.0, 10_000);
    let cooling = last(10.0, 60);
    assert!(cooling.limits.contains(Limit::Cooling));
    assert_eq!(cooling.codes, [PwmCode(0); CHANNELS]);
    assert_eq!(last(10.0, 20_000).limits, Limits::NONE);
}

#[test]
fn a_mirror_that_its_memory_holds_above_rest_says_so() {
    let mut controller = controller(parts());
    controller.compensate_surroundings(false);
    let mut last = |z, ticks| asked_for(&mut controller, z, ticks);
    last(150.0, 100_000);
    let held = last(0.0, 20_000);
    assert!(held.limits.contains(Limit::Cooling));
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
    // A step of the drive, 1 mV of 2.3 V, changes it by nine times as much.
    assert!((power - 10e-3).abs() < 1e-6, "{power}");
}

/// On the way up and down again, by another 10 um from where it turned.
#[test]
fn voltages_that_hold_a_position_take_the_mirror_there() {
    let mut controller = controller(Parts {
        memory: parts().memory,
        ..static_parts()
    });
    let mut follow = |setpoint, ticks: usize| {
        for _ in 0..ticks {
            controller.step(setpoint, NOTHING.0, NOTHING.1);
        }
        (controller.latest().drives, controller.pose().z.0)
    };
    for z in [80.0, 90.0, 30.0, 20.0, 4.0] {
        let (drives, _) = follow(Setpoint::position(Micrometre(z)), 20_000);
        let (_, told) = follow(Setpoint::Drive(drives), 2 * PERIOD);
        // What the core's arithmetic may be off by (docs/requirements.md).
        assert!((told - z).abs() < 5e-3, "{told} for {z}");
    }
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
    // A hundredth of a drive's step of 1 mV.
    assert!((applied[0].0 - (10e-3_f32 * 480.0).sqrt()).abs() < 1e-5);
}

/// What is sensed is the drive behind two poles of 2 kHz and a tick of conversion (`resistance.rs`): whichever actuator's turn it is when a
/// drive begins, the surroundings are not told from what is still on its way.
#[test]
fn a_step_from_nothing_is_no_other_room() {
    for phase in 0..PERIOD {
        let mut controller = controller(parts());
        let ohm = parts().actuators.map(|actuator| actuator.cold_resistance.0);
        // 0.11 V warm a heater by less than 0.2 K.
        let asked = |tick: usize| match (phase..phase + 24).contains(&tick) {
            true => Volt(0.11),
            false => Volt(0.0),
        };
        let (mut applied, mut before) = (Volt(0.0), Volt(0.0));
        let mut poles = [0.0; 2];
        for tick in 0..200 {
            let mut pole_in = before.0;
            for pole in &mut poles {
                *pole += (1.0 - (-core::f32::consts::TAU * 2e3 * 1e-4).exp()) * (pole_in - *pole);
                pole_in = *pole;
            }
            let currents = ohm.map(|ohm| Ampere(pole_in / ohm));
            controller.compensate_surroundings(false);
            let step = controller.step(
                Setpoint::Drive([asked(tick); CHANNELS]),
                [applied; CHANNELS],
                currents,
            );
            (before, applied) = (applied, step.drives[0]);
        }
        let told = *controller.surroundings().expect("known");
        assert!(told.rise.0.abs() < 0.3, "phase {phase}: {told:?}");
    }
}

fn any_float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
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
