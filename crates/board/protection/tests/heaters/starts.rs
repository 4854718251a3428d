//! What is checked before anything is driven.

use control_core::{CHANNELS, Limits, Setpoint, Volt};
use protection::{ChannelState, Denied, Fault, Lease};

use crate::bench::*;

#[test]
fn heaters_are_checked_before_they_are_driven() {
    for (ohm, fault) in [
        (1e9, Fault::OpenHeater),
        (1.0, Fault::ShortCircuit),
        (150.0, Fault::ImplausibleSense),
        (1500.0, Fault::ImplausibleSense),
    ] {
        let mut bench = Bench::new([COLD, COLD, ohm, COLD]);
        bench.protection.command(Lease::FOREVER).expect("no fault");
        let (found, tick) = bench.drive(3.0, 100).expect("it trips");
        assert_eq!(found, fault, "{ohm} ohm");
        assert!(tick < 36, "within the check: {tick}");
        let states = bench.protection.states(bench.applied, Limits::NONE);
        assert_eq!(states[2], ChannelState::Tripped(fault));
        assert_eq!(states[1], ChannelState::Off);
        let denied = Err(Denied::Tripped(fault));
        assert_eq!(bench.protection.command(Lease::FOREVER), denied);
        assert_eq!(bench.protection.renew(Lease::FOREVER), denied);
    }
}

#[test]
fn stages_get_their_supply_two_milliseconds_before_they_drive_and_keep_it_until_a_trip() {
    let wanted = Setpoint::Drive([Volt(1.0); CHANNELS]);
    let mut bench = Bench::new([COLD; CHANNELS]);
    let mut supplied_ticks = 0;
    for _ in 0..START_TICKS {
        supplied_ticks = match bench.protection.powers_stages() {
            true => supplied_ticks + 1,
            false => 0,
        };
        let drives = bench.tick(Setpoint::Off);
        assert!(drives[0] == Volt(0.0) || supplied_ticks >= 20);
    }
    assert!(bench.protection.powers_stages(), "at rest");
    bench
        .protection
        .command(Lease::ticks(50))
        .expect("no fault");
    assert_eq!(bench.tick(wanted), [Volt(1.0); CHANNELS], "at once");
    while bench.tick(wanted) != [Volt(0.0); CHANNELS] {}
    assert!(bench.protection.has_lapsed() && bench.protection.powers_stages());
    bench.protection.command(Lease::FOREVER).expect("no fault");
    assert_eq!(bench.tick(wanted), [Volt(1.0); CHANNELS], "at once");
    bench.protection.trip(Fault::FirmwarePanic);
    assert!(!bench.protection.powers_stages());
}

#[test]
fn what_a_broken_heater_shows_in_a_check_is_forgotten_with_the_fault() {
    for ohm in [1.0, 219.0, 1500.0, 1e9] {
        let mut bench = Bench::new([COLD; CHANNELS]);
        bench.start();
        bench.heaters[2].ohm = ohm;
        bench.protection.recalibrate(&calibration(ALLOWED_RISE));
        assert!(bench.drive(0.0, 40).is_some(), "{ohm} ohm");
        bench.heaters[2].ohm = COLD;
        // A millisecond: no host is quicker.
        for _ in 0..10 {
            bench.tick(Setpoint::Off);
        }
        bench.protection.clear();
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("repaired");
        bench.set_resistances(540.0);
        assert_eq!(bench.drive(3.0, 1000), None, "hot after {ohm} ohm");
    }
}

#[test]
fn a_calibration_in_the_middle_of_a_check_begins_it_anew() {
    for ticks in 1..30 {
        let mut bench = Bench::new([COLD; CHANNELS]);
        for _ in 0..ticks {
            bench.tick(Setpoint::Off);
        }
        bench.protection.recalibrate(&calibration(ALLOWED_RISE));
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("sound");
        bench.set_resistances(540.0);
        assert_eq!(bench.drive(3.0, 1000), None, "after {ticks} ticks");
    }
}

#[test]
fn heaters_that_are_hot_from_before_a_reset_or_a_trip_cool_before_they_are_driven() {
    let mut bench = Bench::new([COLD; CHANNELS]);
    bench.protection.command(Lease::FOREVER).expect("no fault");
    // 120 K, cooling with 0.5 s.
    let mut seconds = 0.0;
    while bench.protection.is_starting() {
        let rise = 120.0 * (-seconds / 0.5_f32).exp();
        bench.set_resistances(COLD * (1.0 + TCR * rise));
        bench.tick(Setpoint::Drive([Volt(3.0); CHANNELS]));
        assert!(
            // The check drives 0.3 V, rounded to codes of 1 mV; what is hotter than 4 K may not be driven, three times the 1.3 K
            // of below.
            bench.applied[0].0 < 0.31 || rise < 4.0,
            "{} V at {rise} K",
            bench.applied[0].0
        );
        seconds += 1e-4;
    }
    // A fall by 0.2 % in 0.25 s is that of 1.3 K: 0.5 s x ln(120 / 1.3), and the checks.
    assert!((2.1..3.0).contains(&seconds), "{seconds} s");
}

#[test]
fn nothing_is_driven_without_a_lease() {
    let mut bench = Bench::new([COLD; CHANNELS]);
    bench.start();
    assert_eq!(bench.drive(2.0, 100), None);
    assert_eq!(bench.applied, [Volt(0.0); CHANNELS]);
    assert_eq!(bench.protection.renew(Lease::FOREVER), Err(Denied::NoLease));
}
