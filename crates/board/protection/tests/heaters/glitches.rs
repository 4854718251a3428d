//! A conversion that goes wrong once is no fault; one that goes wrong again and again is.

use control_core::{AdcCode, CHANNELS, Setpoint, Volt};

use crate::bench::*;

/// What a converter reads that a conversion failed, or a spike on its input.
const WRONG: [AdcCode; 2] = [AdcCode(0), AdcCode(u16::MAX)];
const DRIVES_V: [f32; 5] = [0.0, 0.3, 1.0, 2.0, 3.5];
/// Of a heater that is as warm as the factory drives it.
const WARM: f32 = 450.0;

impl Bench {
    /// Drives for a tick in which channel 1 reads `wrong`; whether the board has tripped.
    fn misread(&mut self, volt: f32, wrong: AdcCode) -> bool {
        let mut codes: [AdcCode; CHANNELS] =
            std::array::from_fn(|i| self.heaters[i].sense(self.applied[i]));
        codes[1] = wrong;
        self.tick_with(Setpoint::Drive([Volt(volt); CHANNELS]), codes, 0);
        self.protection.first_cause().is_some()
    }
}

#[test]
fn one_wrong_reading_of_a_sound_heater_does_not_trip() {
    for volt in DRIVES_V {
        for wrong in WRONG {
            let mut bench = Bench::driving([WARM; CHANNELS], volt);
            for round in 0..20 {
                assert!(
                    !bench.misread(volt, wrong),
                    "{wrong:?} at {volt} V, {round}"
                );
                assert_eq!(
                    bench.drive(volt, 20),
                    None,
                    "after {wrong:?} at {volt} V, {round}"
                );
            }
        }
    }
}

#[test]
fn one_wrong_reading_before_the_heaters_are_checked_does_not_trip() {
    for tick in 0..20 {
        for wrong in WRONG {
            let mut bench = Bench::new([COLD; CHANNELS]);
            assert_eq!(bench.drive(0.0, tick), None);
            assert!(!bench.misread(0.0, wrong), "{wrong:?} in tick {tick}");
            bench.start();
            assert_eq!(
                bench.protection.first_cause(),
                None,
                "{wrong:?} in tick {tick}"
            );
        }
    }
}

#[test]
fn one_wrong_reading_on_the_way_does_not_trip() {
    // 5 Hz and 500 Hz, between the slowest that heaters follow and the fastest that the filter lets through.
    for period in [2000_u16, 20] {
        for wrong in WRONG {
            let mut bench = Bench::driving([WARM; CHANNELS], 1.0);
            for tick in 0..4000_u16 {
                let phase = std::f32::consts::TAU * f32::from(tick) / f32::from(period);
                let volt = 1.5 + 1.4 * phase.sin();
                let has_tripped = match tick % 37 {
                    0 => bench.misread(volt, wrong),
                    _ => bench.drive(volt, 1).is_some(),
                };
                assert!(!has_tripped, "{wrong:?} in tick {tick}, period {period}");
            }
        }
    }
}

#[test]
fn readings_that_are_wrong_at_every_second_tick_trip() {
    for volt in DRIVES_V.into_iter().skip(1) {
        for wrong in WRONG {
            let mut bench = Bench::driving([WARM; CHANNELS], volt);
            let trips =
                (0..100).any(|_| bench.misread(volt, wrong) || bench.drive(volt, 1).is_some());
            assert!(trips, "{wrong:?} at {volt} V");
        }
    }
}
