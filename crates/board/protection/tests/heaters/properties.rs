//! Sound heaters, leases and trips, whatever is driven and sensed.

use control_core::{AdcCode, Ampere, CHANNELS, Setpoint, SupplyCode, Volt};
use proptest::prelude::*;
use protection::{Denied, Fault, Lease, Protection, Reading};

use crate::bench::*;

fn any_float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

proptest! {
    #[test]
    fn sound_heaters_never_trip_whatever_is_driven(
        ohm in proptest::array::uniform4(345.0_f32..540.0),
        steps in proptest::collection::vec((0.0_f32..3.5, 1_u32..40, any::<bool>()), 1..40),
    ) {
        let mut bench = Bench::new(ohm);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        let mut volt = 0.0;
        for (target, ticks, is_ramp) in steps {
            let slope = if is_ramp { (target - volt) / ticks as f32 } else { target - volt };
            for _ in 0..ticks {
                volt = if is_ramp { volt + slope } else { target };
                bench.tick(Setpoint::Drive([Volt(volt); CHANNELS]));
                prop_assert_eq!(bench.protection.first_cause(), None, "at {} V", volt);
            }
        }
    }

    #[test]
    fn a_lease_ends_at_its_tick_in_a_ramp_of_a_tenth_of_a_second(
        lease in 30_u32..500,
        renewals in proptest::collection::vec((1_u32..30, 30_u32..200), 0..5),
    ) {
        let mut bench = Bench::new([COLD; CHANNELS]);
        bench.start();
        bench.protection.command(Lease::ticks(lease)).expect("no fault");
        let wanted = Setpoint::Drive([Volt(3.5); CHANNELS]);
        let mut left = lease;
        for (ticks, renewal) in renewals {
            for _ in 0..ticks {
                bench.tick(wanted);
                left -= 1;
            }
            bench.protection.renew(Lease::ticks(renewal)).expect("still driven");
            left = left.max(renewal);
        }
        for _ in 0..left {
            bench.tick(wanted);
            prop_assert!(!bench.protection.has_lapsed());
        }
        let mut before = bench.applied[0].0;
        for _ in 0..1000 {
            let drive = bench.tick(wanted)[0].0;
            prop_assert!(bench.protection.has_lapsed());
            // 4 mV a tick, and a code of 1 mV.
            prop_assert!(drive <= before && before - drive < 5e-3);
            before = drive;
        }
        prop_assert_eq!(bench.applied, [Volt(0.0); CHANNELS]);
        prop_assert_eq!(bench.protection.renew(Lease::FOREVER), Err(Denied::NoLease));
    }

    #[test]
    fn a_tripped_board_stays_at_zero_whatever_is_sensed(
        drives in proptest::array::uniform4(any_float()),
        currents in proptest::array::uniform4(any_float()),
        codes in proptest::array::uniform4(any::<u16>()),
        supply: u16,
        missed_ticks: u16,
        is_over_voltage: bool,
        lease: u32,
    ) {
        let mut protection = Protection::new(&calibration(ALLOWED_RISE));
        let reading = Reading {
            codes: codes.map(AdcCode),
            currents: currents.map(Ampere),
            supply: SupplyCode(supply),
            missed_ticks,
            is_over_voltage,
        };
        let drives = drives.map(Volt);
        let _ = protection.command(Lease::ticks(lease));
        for _ in 0..40 {
            let allowed = protection.tick(Setpoint::Drive(drives), drives, &reading);
            if protection.first_cause().is_some() {
                prop_assert_eq!(allowed, Setpoint::Off);
            }
        }
        protection.trip(Fault::HardFault);
        prop_assert_eq!(protection.tick(Setpoint::Drive(drives), drives, &reading), Setpoint::Off);
        prop_assert!(protection.command(Lease::FOREVER).is_err());
    }
}
