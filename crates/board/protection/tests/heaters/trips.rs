//! What trips, by which name and how soon; what does not.

use control_core::{
    AdcCode, Ampere, CHANNELS, Calibration, Kelvin, Limits, PwmCode, Setpoint, SupplyCode, Volt,
};
use protection::{ChannelState, Fault, Lease};

use crate::bench::*;
use crate::common::parts;

#[test]
fn heaters_that_break_while_they_are_driven_trip_within_a_millisecond() {
    for volt in [0.3, 1.0, 2.0, 3.5] {
        for (ohm, fault) in [
            (1e9, Fault::OpenHeater),
            (1.0, Fault::ShortCircuit),
            (800.0, Fault::ImplausibleSense),
        ] {
            let mut bench = Bench::driving([450.0; CHANNELS], volt);
            bench.heaters[1].ohm = ohm;
            let (found, tick) = bench.drive(volt, 100).expect("it trips");
            assert_eq!(found, fault, "{ohm} ohm at {volt} V");
            assert!(tick < 10, "{ohm} ohm at {volt} V: after {tick} ticks");
        }
    }
}

#[test]
fn too_much_current_trips_by_its_name() {
    let mut bench = Bench::driving([450.0; CHANNELS], 3.5);
    bench.heaters[0].ohm = 3.5 / 11.5e-3;
    assert_eq!(bench.drive(3.5, 20), Some((Fault::OverCurrent, 2)));
    let mut bench = Bench::driving([450.0; CHANNELS], 1.0);
    bench.heaters[0].ohm = 0.45 * COLD;
    assert_eq!(bench.drive(1.0, 20), Some((Fault::ImplausibleSense, 2)));
}

#[test]
fn a_heater_too_hot_trips_and_a_hot_one_does_not() {
    let ohm_at = |rise: f32| COLD * (1.0 + TCR * rise);
    for volt in [1.0, 2.0, 3.5] {
        let mut bench = Bench::driving([COLD; CHANNELS], volt);
        assert_eq!(bench.warm(3, ohm_at(130.0), volt), None, "{volt} V");
        assert_eq!(bench.drive(volt, 1000), None, "{volt} V");
        bench.heaters[3].ohm = ohm_at(200.0);
        let (fault, _) = bench.drive(volt, 20).expect("it trips");
        assert_eq!(fault, Fault::OverTemperature, "{volt} V");
    }
}

#[test]
fn what_is_too_hot_follows_the_calibration_up_to_a_ceiling() {
    let ohm_at = |rise: f32| COLD * (1.0 + TCR * rise);
    // A quarter more than allowed, and 11 K for a cold resistance that is off by 15 ohm.
    for (allowed, sound, hot) in [
        (60.0, 80.0, 92.0),
        (100.0, 130.0, 142.0),
        (900.0, 130.0, 146.0),
    ] {
        let mut bench = Bench::of(&calibration(allowed), [COLD; CHANNELS]);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        assert_eq!(bench.drive(2.0, 100), None);
        assert_eq!(bench.warm(1, ohm_at(sound), 2.0), None);
        assert_eq!(bench.drive(2.0, 1000), None, "{allowed} K allowed");
        let (fault, _) = bench.warm(1, ohm_at(hot), 2.0).expect("it trips");
        assert_eq!(fault, Fault::OverTemperature, "{allowed} K allowed");
    }
}

/// Heaters of 360 ohm when cold, as a line describes them through what warm ones have; their curve has so many kelvins from knot to knot.
fn along_a_line(line_ohm: f32, line_tcr: f32, step_k: f32) -> Calibration {
    let mut parts = parts(line_ohm, line_tcr, 3.5, 71.0);
    for actuator in &mut parts.actuators {
        let begins_k = (COLD / line_ohm - 1.0) / line_tcr;
        actuator.sensed_rises.top = Kelvin(71.0);
        actuator.sensed_rises.knots = std::array::from_fn(|i| begins_k + step_k * i as f32);
    }
    Calibration::new(parts).expect("plausible")
}

/// The resistances of a mirror that was calibrated are a line through what warm heaters have: 336 ohm and twice platinum's
/// coefficient, where a cold one has 360.
#[test]
fn a_line_that_begins_below_the_cold_heater_makes_no_hot_one_of_it() {
    let calibration = along_a_line(336.0, 2.0 * TCR, 4.0);
    let mut bench = Bench::of(&calibration, [COLD; CHANNELS]);
    bench.start();
    bench.protection.command(Lease::FOREVER).expect("no fault");
    assert_eq!(bench.drive(2.0, 100), None);
    let ohm_at = |rise: f32| COLD * (1.0 + TCR * rise);
    assert_eq!(bench.warm(1, ohm_at(130.0), 2.0), None);
    let hot = bench.warm(1, ohm_at(146.0), 2.0).expect("it trips");
    assert_eq!(hot.0, Fault::OverTemperature);
}

/// And one that begins above it makes no cold room an impossible one: a heater counts from what it has at rest.
#[test]
fn a_line_that_begins_above_the_cold_heater_leaves_room_for_a_cold_one() {
    let calibration = along_a_line(372.0, 0.65 * TCR, 6.0);
    // A room that is so much colder than at calibration.
    let starts = |colder_k: f32| {
        let mut bench = Bench::of(&calibration, [COLD * (1.0 - TCR * colder_k); CHANNELS]);
        for _ in 0..START_TICKS {
            bench.tick(Setpoint::Off);
        }
        bench.protection.first_cause()
    };
    assert_eq!(starts(23.0), None);
    assert_eq!(starts(27.0), Some(Fault::ImplausibleSense));
}

#[test]
fn current_where_nothing_is_driven_trips() {
    let mut bench = Bench::new([COLD; CHANNELS]);
    bench.start();
    // The envelope of the drive falls from the check's.
    assert_eq!(bench.drive(0.0, 50), None);
    let codes = [0.0, 57e-6, 0.0, 0.0].map(|current| AdcCode::nearest(Ampere(current)));
    for _ in 0..3 {
        bench.tick_with(Setpoint::Off, codes, 0);
    }
    assert_eq!(
        bench.protection.first_cause(),
        Some(Fault::ImplausibleSense)
    );
}

#[test]
fn a_sense_that_stands_still_while_the_drive_moves_trips() {
    let mut bench = Bench::driving([450.0; CHANNELS], 1.0);
    let still = AdcCode::nearest(Ampere(1.0 / 450.0)).0;
    let mut codes = [AdcCode(still); CHANNELS];
    for tick in 0..100_u16 {
        for (i, code) in codes.iter_mut().enumerate().skip(1) {
            code.0 = still + tick % 3 + i as u16;
        }
        // 1 V to 1.1 V: still plausible, but channel 0 does not follow.
        let volt = 1.0 + f32::from(tick) * 1e-3;
        bench.tick_with(Setpoint::Drive([Volt(volt); CHANNELS]), codes, 0);
    }
    assert_eq!(bench.protection.first_cause(), Some(Fault::FrozenSense));
}

#[test]
fn supply_and_overrun_trip_all_channels() {
    let mut bench = Bench::driving([450.0; CHANNELS], 1.0);
    bench.supply = SupplyCode::from_millivolt(4000);
    assert_eq!(bench.drive(1.0, 10), Some((Fault::SupplyOutOfRange, 2)));
    let mut bench = Bench::driving([450.0; CHANNELS], 1.0);
    let codes = std::array::from_fn(|i| bench.heaters[i].sense(bench.applied[i]));
    let drives = bench.tick_with(Setpoint::Drive([Volt(1.0); CHANNELS]), codes, 7);
    assert_eq!(bench.protection.first_cause(), Some(Fault::TickOverrun));
    assert_eq!(drives, [Volt(0.0); CHANNELS]);
    let states = bench.protection.states(drives, Limits::NONE);
    assert_eq!(
        states,
        [ChannelState::Tripped(Fault::TickOverrun); CHANNELS]
    );
}

#[test]
fn what_the_comparators_find_trips_at_once() {
    let mut bench = Bench::driving([450.0; CHANNELS], 1.0);
    bench.is_over_voltage = true;
    assert_eq!(bench.drive(1.0, 1), Some((Fault::OutputOverVoltage, 0)));
    assert!(!bench.protection.powers_stages());
    // They say so until the outputs are enabled again; the currents fall meanwhile.
    for _ in 0..20 {
        bench.tick(Setpoint::Off);
    }
    bench.protection.clear();
    while !bench.protection.powers_stages() {
        assert_eq!(bench.drive(1.0, 1), None);
    }
    let mut still_there = bench.clone();
    assert_eq!(
        still_there.drive(1.0, 1),
        Some((Fault::OutputOverVoltage, 0))
    );
    bench.is_over_voltage = false;
    bench.protection.command(Lease::FOREVER).expect("cleared");
    assert_eq!(bench.drive(1.0, START_TICKS), None);
}

#[test]
fn a_cleared_board_drives_again_and_a_fault_that_is_still_there_trips_again() {
    let mut bench = Bench::driving([450.0; CHANNELS], 2.0);
    bench.heaters[0].ohm = 1e9;
    assert!(bench.drive(2.0, 20).is_some());
    bench.protection.clear();
    bench.protection.command(Lease::FOREVER).expect("cleared");
    assert!(bench.drive(2.0, START_TICKS).is_some());
    bench.heaters[0].ohm = 450.0;
    bench.protection.clear();
    bench.start();
    bench.protection.command(Lease::FOREVER).expect("cleared");
    assert_eq!(bench.drive(2.0, 100), None);
    assert_eq!(bench.applied, [PwmCode(2000).drive(); CHANNELS]);
}

#[test]
fn the_hottest_allowed_lies_above_what_the_factory_drives() {
    let top = calibration(ALLOWED_RISE).actuators()[0]
        .resistance(Kelvin(129.0))
        .0;
    let mut bench = Bench::driving([top; CHANNELS], 3.5);
    assert_eq!(bench.drive(3.5, 1000), None);
}

/// A room 20 K colder than at calibration, or a heater that has 28 ohm less than its calibration says: what the check showed counts where
/// it is hot, too. A heater that only then reads so much colder trips, and so does one that reads colder still.
#[test]
fn a_heater_that_is_colder_from_the_first_check_on_is_sound_when_it_is_hot() {
    let ohm_at = |rise: f32| COLD * (1.0 + TCR * rise);
    // 3 V for two seconds, in which the rise that they make counts.
    let held = |cold_k: f32, hot_k: f32| {
        let mut bench = Bench::new([ohm_at(cold_k); CHANNELS]);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        let warmed = (0..CHANNELS).find_map(|channel| bench.warm(channel, ohm_at(hot_k), 3.0));
        warmed
            .or_else(|| bench.drive(3.0, 20_000))
            .map(|(fault, _)| fault)
    };
    let least_k = (0..120).map(|k| k as f32).find(|k| held(0.0, *k).is_none());
    let least_k = least_k.expect("a heater as warm as that is sound");
    // Half of what 3 V make by the calibration, some 90 K, less 25 K, and what is left open.
    assert!((5.0..20.0).contains(&least_k), "{least_k}");
    for cold_k in [-5.0, -10.0, -20.0] {
        assert_eq!(held(cold_k, least_k + cold_k + 2.0), None, "{cold_k}");
        let colder = held(cold_k, least_k + cold_k - 5.0);
        assert_eq!(colder, Some(Fault::ImplausibleSense), "{cold_k}");
    }
    // A warmer room makes nothing stricter.
    assert_eq!(held(15.0, least_k + 1.0), None);
}

/// A mirror that loses nearly twice the heat that the factory's calibration says is sound, and once it has shown how warm it becomes, a
/// sense that then reads it colder is none.
#[test]
fn what_a_heater_has_become_it_is_to_become_again() {
    let ohm_at = |rise: f32| COLD * (1.0 + TCR * rise);
    // By the calibration 100 K.
    for (shown_k, sound_k) in [(48.0, 30.0), (85.0, 55.0)] {
        let mut bench = Bench::new([COLD; CHANNELS]);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        for channel in 0..CHANNELS {
            assert_eq!(bench.warm(channel, ohm_at(shown_k), 3.0), None, "{shown_k}");
        }
        assert_eq!(bench.drive(3.0, 20_000), None, "{shown_k}");
        bench.set_resistances(ohm_at(sound_k));
        assert_eq!(bench.drive(3.0, 1000), None, "{shown_k}, {sound_k}");
        // Half of the drive, and back: what is learnt on the way down, where it may still be warm, is nothing.
        assert_eq!(bench.drive(1.5, 1000), None);
        assert_eq!(bench.drive(3.0, 20_000), None, "{shown_k}, {sound_k}");
        // Two seconds after the lower drive the higher one counts for nine tenths.
        bench.set_resistances(ohm_at(0.75 * shown_k - 30.0));
        let (fault, _) = bench.drive(3.0, 1000).expect("it is far too cold");
        assert_eq!(fault, Fault::ImplausibleSense, "{shown_k}");
    }
}
