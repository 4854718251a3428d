use super::*;
use crate::calibration::Calibration;
use crate::calibration::tests::{actuator, parts};
use crate::units::Micrometre;
use proptest::prelude::*;

#[test]
fn the_actuators_share_their_range() {
    let mut parts = parts();
    parts.actuators[3] = actuator(150.0, 97.0);
    let refused = CalibrationError::number(Field::Top, 0, Problem::NotTheSame).of_actuator(3);
    assert_eq!(Calibration::new(parts), Err(refused));
}

#[test]
fn a_range_in_another_unit_is_refused() {
    for top_um in [0.1467, 1e-9, 1.5e5] {
        let mut parts = parts();
        parts.actuators = [actuator(top_um, 97.0); crate::CHANNELS];
        let refused = CalibrationError::number(Field::Top, 0, Problem::OutOfRange);
        assert_eq!(Calibration::new(parts), Err(refused.of_actuator(0)));
    }
}

/// One number off at a time, and the name under which it is refused.
fn number_off(which: usize, bad: f32) -> (Parts, Field) {
    let mut p = parts();
    let (number, field) = match which {
        0 => (&mut p.actuators[2].cold_resistance.0, Field::ColdResistance),
        1 => (&mut p.actuators[0].tcr.0, Field::Tcr),
        2 => (
            &mut p.actuators[3].thermal_resistance.0,
            Field::ThermalResistance,
        ),
        3 => (&mut p.actuators[1].loss_growth.0, Field::LossGrowth),
        4 => (&mut p.heat.fast[1].weight, Field::FastPole),
        5 => (&mut p.heat.fast[2].time.0, Field::FastPole),
        6 => (&mut p.heat.slow[0].weight, Field::SlowPole),
        7 => (&mut p.heat.slow[1].time.0, Field::SlowPole),
        8 => (&mut p.memory.plays[3].weight, Field::Play),
        9 => (&mut p.memory.plays[0].radius.0, Field::Play),
        10 => (&mut p.memory.creep[1].weight, Field::Creep),
        11 => (&mut p.memory.creep[2].time.0, Field::Creep),
        12 => (&mut p.memory.release.0, Field::Release),
        17 => (&mut p.plate.levers[2].y.0, Field::Lever),
        18 => (&mut p.plate.levers[1].warp, Field::Lever),
        13 => (&mut p.path.move_time.0, Field::MoveTime),
        25 => (&mut p.path.resonance.frequency.0, Field::ResonanceFrequency),
        26 => (&mut p.path.resonance.quality, Field::ResonanceQuality),
        27 => (&mut p.heat.beam_lag.0, Field::BeamLag),
        28 => (&mut p.heat.time_growth.0, Field::TimeGrowth),
        29 => (&mut p.actuators[3].slower_by.0, Field::SlowerBy),
        14 => (&mut p.bounds.drive.0, Field::MaxDrive),
        15 => (&mut p.bounds.power.0, Field::MaxPower),
        19 => (&mut p.actuators[1].sensed_rises.knots[7], Field::SensedRise),
        30 => (&mut p.actuators[3].sensed_rises.knots[0], Field::SensedRise),
        20 => (&mut p.ambient_ratio, Field::AmbientRatio),
        31 => (&mut p.sensed_crosstalk, Field::SensedCrosstalk),
        21 => (&mut p.residual.piston.0, Field::Residual),
        22 => (&mut p.residual.apart, Field::Residual),
        32 => (&mut p.residual.tried.0, Field::Tried),
        23 => (&mut p.heat.shared[0], Field::SharedPart),
        24 => (&mut p.heat.shared[3], Field::SharedPart),
        _ => (&mut p.bounds.rise.0, Field::MaxRise),
    };
    *number = bad;
    (p, field)
}

proptest! {
    #[test]
    fn a_number_that_is_off_is_named(
        which in 0_usize..34,
        bad in prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(-1.0e6), Just(1e9)],
    ) {
        let (parts, field) = number_off(which, bad);
        let Err(CalibrationError::Number { field: named, .. }) = Calibration::new(parts) else {
            return Err(TestCaseError::fail("it was accepted"));
        };
        prop_assert_eq!(named, field);
    }
}

#[test]
fn what_the_board_does_not_allow_is_refused_by_name() {
    // The last is what an attack once had accepted.
    for (number, bad, field) in [
        (0, 309.0, Field::ColdResistance),
        (0, 451.0, Field::ColdResistance),
        (0, 720.0, Field::ColdResistance),
        (1, 0.9e-3, Field::Tcr),
        (1, 0.1, Field::Tcr),
        (30, 70.0, Field::SensedRise),
        (30, -70.0, Field::SensedRise),
        (14, 3.501, Field::MaxDrive),
        (14, 1000.0, Field::MaxDrive),
        (15, 41e-3, Field::MaxPower),
    ] {
        let (parts, _) = number_off(number, bad);
        let Err(CalibrationError::Number {
            field: named,
            problem,
            ..
        }) = Calibration::new(parts)
        else {
            panic!("{field:?} of {bad} was accepted");
        };
        assert_eq!((named, problem), (field, Problem::BeyondTheBoard));
    }
}

#[test]
fn levers_that_span_no_plate_are_refused() {
    let mut on_a_line = parts();
    for lever in &mut on_a_line.plate.levers {
        lever.y = Micrometre(0.0);
    }
    let mut alike = parts();
    alike.plate.levers = [alike.plate.levers[0]; crate::CHANNELS];
    for parts in [on_a_line, alike] {
        let refused = CalibrationError::number(Field::Lever, 0, Problem::NoPlate);
        assert_eq!(Calibration::new(parts), Err(refused));
    }
    let mut unknown = parts();
    unknown.plate = Plate::UNKNOWN;
    assert!(Calibration::new(unknown).is_ok());
}

#[test]
fn weights_must_add_up() {
    let mut heat = parts();
    heat.heat.fast[0].weight = 0.4;
    let mut plays = parts();
    plays.memory.plays[3].weight = 0.89;
    for (parts, field) in [(heat, Field::FastPole), (plays, Field::Play)] {
        let refused = CalibrationError::number(field, 0, Problem::Sum);
        assert_eq!(Calibration::new(parts), Err(refused));
    }
    // What only one fast pole does on its own, and that one hardly.
    let mut shared = parts();
    shared.heat.fast[0].weight = 0.02;
    shared.heat.fast[1].weight = 0.78;
    shared.heat.shared = [0.0, 1.0, 1.0, 0.0, 0.0];
    let refused = CalibrationError::number(Field::SharedPart, 0, Problem::Sum);
    assert_eq!(Calibration::new(shared), Err(refused));
    // A beam's pole is its own.
    let mut quick = parts();
    quick.heat.fast[1].time = Second(5e-3);
    let refused = CalibrationError::number(Field::SharedPart, 1, Problem::OutOfRange);
    assert_eq!(Calibration::new(quick), Err(refused));
    let mut radii = parts();
    radii.memory.plays[2].radius = Micrometre(5.0);
    let refused = CalibrationError::number(Field::Play, 2, Problem::NotRising);
    assert_eq!(Calibration::new(radii), Err(refused));
}

#[test]
fn time_constants_neither_vanish_nor_grow_where_there_are_none() {
    let growing = |heat: Heat, growth_s_per_k: f32| {
        let mut parts = parts();
        parts.actuators = [actuator(170.0, 97.0); crate::CHANNELS];
        parts.heat = heat;
        parts.heat.time_growth.0 = growth_s_per_k;
        Calibration::new(parts)
    };
    let refused = CalibrationError::number(Field::TimeGrowth, 0, Problem::AtTheHighestRise);
    assert_eq!(growing(parts().heat, -1e-3), Err(refused));
    assert!(growing(Heat::INSTANT, 0.0).is_ok());
    assert_eq!(growing(Heat::INSTANT, 1e-6), Err(refused));
}

#[test]
fn a_plate_of_some_quality_rings_at_some_frequency() {
    let (parts, field) = number_off(25, 0.0);
    let refused = CalibrationError::number(field, 0, Problem::OutOfRange);
    assert_eq!(Calibration::new(parts), Err(refused));
}

#[test]
fn no_actuator_is_so_quick_that_nothing_is_left_of_its_time_constants() {
    let quicker = |slower_by_s: f32, growth_s_per_k: f32| {
        let mut parts = parts();
        parts.actuators[1].slower_by.0 = slower_by_s;
        parts.heat.time_growth.0 = growth_s_per_k;
        Calibration::new(parts)
    };
    // A step begins as with a time constant of 2 ms, and 130 K take 1.3 ms of it.
    assert!(quicker(-1e-3, 0.0).is_ok() && quicker(0.0, -1e-5).is_ok());
    let refused = CalibrationError::number(Field::SlowerBy, 0, Problem::OutOfRange);
    assert_eq!(quicker(-1e-3, -1e-5), Err(refused.of_actuator(1)));
}

#[test]
fn what_is_not_there_is_allowed() {
    let mut empty = parts();
    empty.heat = Heat::INSTANT;
    empty.actuators = [actuator(170.0, 97.0); crate::CHANNELS];
    empty.memory = Memory::NONE;
    assert!(Calibration::new(empty).is_ok());
}
