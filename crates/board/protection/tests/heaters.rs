//! The protection in front of four heaters, sound ones and broken ones.

use control_core::calibration::{Bounds, Heat, Label, Memory, Origin, Parts, Path, Plate};
use control_core::{
    ActuatorCalibration, AdcCode, Ampere, CHANNELS, Calibration, CurrentSense, InverseTable,
    Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, PwmCode, Second, SenseCalibration, Setpoint,
    SupplyCode, Volt, Watt,
};
use proptest::prelude::*;
use protection::{ChannelState, Denied, Fault, Lease, Protection, Reading};

const COLD: f32 = 360.0;
const TCR: f32 = 3.92e-3;
const SOUND_SUPPLY: SupplyCode = SupplyCode::from_millivolt(5000);

/// A mirror that may be this much warmer than ambient.
fn calibration(rise: f32) -> Calibration {
    let actuator = ActuatorCalibration {
        cold_resistance: Ohm(COLD),
        tcr: PerKelvin(TCR),
        thermal_resistance: KelvinPerWatt(5700.0),
        loss_growth: PerKelvin(0.0),
        shape: InverseTable::new(Micrometre(170.0), core::array::from_fn(|i| i as f32))
            .expect("rising"),
    };
    Calibration::new(Parts {
        origin: Origin {
            device: Label::EMPTY,
            date: Label::EMPTY,
            model_hash: 0,
        },
        actuators: [actuator; CHANNELS],
        plate: Plate::UNKNOWN,
        heat: Heat::INSTANT,
        memory: Memory::NONE,
        path: Path {
            move_time: Second(0.0),
        },
        bounds: Bounds {
            drive: Volt(3.5),
            power: Watt(34e-3),
            rise: Kelvin(rise),
        },
    })
    .expect("plausible")
}

/// Two checks of 25 ticks with a pause of 2501 between, and 20 ticks each until the stages have their supply.
const START_TICKS: u32 = 2591;

/// As the factory's.
const ALLOWED_RISE: f32 = 135.0;

/// A channel behind the board's output filter, two poles at 2 kHz, and the mean of its sense.
#[derive(Clone, Copy)]
struct Heater {
    ohm: f32,
    stages: [f32; 2],
    noise: u32,
}

impl Heater {
    fn new(ohm: f32, noise: u32) -> Self {
        Self {
            ohm,
            stages: [0.0; 2],
            noise,
        }
    }

    /// What is sensed at the end of a tick at `drive`.
    fn sense(&mut self, drive: Volt) -> AdcCode {
        let step = 1.0 - (-1.2566_f32 / 10.0).exp();
        for _ in 0..10 {
            self.stages[0] += step * (drive.0 - self.stages[0]);
            self.stages[1] += step * (self.stages[0] - self.stages[1]);
        }
        self.noise = self
            .noise
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        let noise = (self.noise >> 24) as f32 / 16.0 - 8.0;
        let sound = AdcCode::nearest(Ampere(self.stages[1] / self.ohm));
        AdcCode((f32::from(sound.0) + noise) as u16)
    }
}

/// Board and heaters: what the firmware does around the protection, without the core.
#[derive(Clone)]
struct Bench {
    protection: Protection,
    heaters: [Heater; CHANNELS],
    supply: SupplyCode,
    is_over_voltage: bool,
    applied: [Volt; CHANNELS],
}

impl Bench {
    fn new(ohm: [f32; CHANNELS]) -> Self {
        Self::of(&calibration(ALLOWED_RISE), ohm)
    }

    fn of(calibration: &Calibration, ohm: [f32; CHANNELS]) -> Self {
        let mut seed = 0;
        let heaters = ohm.map(|ohm| {
            seed += 1;
            Heater::new(ohm, seed)
        });
        Self {
            protection: Protection::new(calibration),
            heaters,
            supply: SOUND_SUPPLY,
            applied: [Volt(0.0); CHANNELS],
            is_over_voltage: false,
        }
    }

    fn tick(&mut self, wanted: Setpoint) -> [Volt; CHANNELS] {
        let codes = std::array::from_fn(|i| self.heaters[i].sense(self.applied[i]));
        self.tick_with(wanted, codes, 0)
    }

    fn tick_with(
        &mut self,
        wanted: Setpoint,
        codes: [AdcCode; CHANNELS],
        missed_ticks: u16,
    ) -> [Volt; CHANNELS] {
        let reading = Reading {
            codes,
            currents: CurrentSense::new(&SenseCalibration::DESIGNED).currents(codes),
            supply: self.supply,
            missed_ticks,
            is_over_voltage: self.is_over_voltage,
        };
        let allowed = self.protection.tick(wanted, self.applied, &reading);
        self.applied = match allowed {
            Setpoint::Drive(drives) => drives.map(|drive| PwmCode::nearest(drive).drive()),
            _ => [Volt(0.0); CHANNELS],
        };
        self.applied
    }

    /// Drives for so many ticks; the fault and the tick at which the board trips, if it does.
    fn drive(&mut self, volt: f32, ticks: u32) -> Option<(Fault, u32)> {
        for tick in 0..ticks {
            let drives = self.tick(Setpoint::Drive([Volt(volt); CHANNELS]));
            if let Some(fault) = self.protection.first_cause() {
                assert_eq!(
                    drives,
                    [Volt(0.0); CHANNELS],
                    "zero in the tick of detection"
                );
                return Some((fault, tick));
            }
        }
        None
    }

    /// Drives while a heater's resistance goes to `ohm` within 10 ms.
    fn warm(&mut self, channel: usize, ohm: f32, volt: f32) -> Option<(Fault, u32)> {
        let step = (ohm - self.heaters[channel].ohm) / 100.0;
        (0..100).find_map(|_| {
            self.heaters[channel].ohm += step;
            self.drive(volt, 1)
        })
    }

    /// Gives all heaters this resistance.
    fn set_resistances(&mut self, ohm: f32) {
        self.heaters = self.heaters.map(|heater| Heater { ohm, ..heater });
    }

    /// Lets the heaters be checked, and cool.
    fn start(&mut self) {
        for _ in 0..START_TICKS {
            self.tick(Setpoint::Off);
        }
        assert!(!self.protection.is_starting());
    }

    fn driving(ohm: [f32; CHANNELS], volt: f32) -> Self {
        let mut bench = Self::new(ohm);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        assert_eq!(bench.drive(volt, 100), None);
        bench
    }
}

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
        let states = bench
            .protection
            .states(bench.applied, control_core::Limits::NONE);
        assert_eq!(states[2], ChannelState::Tripped(fault));
        assert_eq!(states[1], ChannelState::Off);
        let denied = Err(Denied::Tripped(fault));
        assert_eq!(bench.protection.command(Lease::FOREVER), denied);
        assert_eq!(bench.protection.renew(Lease::FOREVER), denied);
    }
}

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
    let states = bench.protection.states(drives, control_core::Limits::NONE);
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

#[test]
fn the_hottest_allowed_lies_above_what_the_factory_drives() {
    let top = calibration(ALLOWED_RISE).actuators()[0]
        .resistance(Kelvin(129.0))
        .0;
    let mut bench = Bench::driving([top; CHANNELS], 3.5);
    assert_eq!(bench.drive(3.5, 1000), None);
}
