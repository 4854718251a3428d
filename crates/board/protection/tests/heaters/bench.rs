//! Board and heaters around the protection: resistors behind the output filter, no core, no mirror.

use control_core::{
    AdcCode, Ampere, CHANNELS, Calibration, CurrentSense, PwmCode, SenseCalibration, Setpoint,
    SupplyCode, Volt,
};
use protection::{Fault, Lease, Protection, Reading};

use crate::common::parts;

pub(crate) const COLD: f32 = 360.0;
pub(crate) const TCR: f32 = 3.92e-3;
pub(crate) const SOUND_SUPPLY: SupplyCode = SupplyCode::from_millivolt(5000);

/// A mirror that may be this much warmer than ambient.
pub(crate) fn calibration(rise: f32) -> Calibration {
    Calibration::new(parts(COLD, TCR, 3.5, rise)).expect("plausible")
}

/// Two checks of 25 ticks with a pause of 2501 between, and 20 ticks each until the stages have their supply.
pub(crate) const START_TICKS: u32 = 2591;

/// As the factory's.
pub(crate) const ALLOWED_RISE: f32 = 135.0;

/// A channel behind the board's output filter, two poles at 2 kHz, and the mean of its sense.
#[derive(Clone, Copy)]
pub(crate) struct Heater {
    pub(crate) ohm: f32,
    stages: [f32; 2],
    noise: u32,
}

impl Heater {
    pub(crate) fn new(ohm: f32, noise: u32) -> Self {
        Self {
            ohm,
            stages: [0.0; 2],
            noise,
        }
    }

    /// What is sensed at the end of a tick at `drive`.
    pub(crate) fn sense(&mut self, drive: Volt) -> AdcCode {
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
pub(crate) struct Bench {
    pub(crate) protection: Protection,
    pub(crate) heaters: [Heater; CHANNELS],
    pub(crate) supply: SupplyCode,
    pub(crate) is_over_voltage: bool,
    pub(crate) applied: [Volt; CHANNELS],
}

impl Bench {
    pub(crate) fn new(ohm: [f32; CHANNELS]) -> Self {
        Self::of(&calibration(ALLOWED_RISE), ohm)
    }

    pub(crate) fn of(calibration: &Calibration, ohm: [f32; CHANNELS]) -> Self {
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

    pub(crate) fn tick(&mut self, wanted: Setpoint) -> [Volt; CHANNELS] {
        let codes = std::array::from_fn(|i| self.heaters[i].sense(self.applied[i]));
        self.tick_with(wanted, codes, 0)
    }

    pub(crate) fn tick_with(
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
    pub(crate) fn drive(&mut self, volt: f32, ticks: u32) -> Option<(Fault, u32)> {
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
    pub(crate) fn warm(&mut self, channel: usize, ohm: f32, volt: f32) -> Option<(Fault, u32)> {
        let step = (ohm - self.heaters[channel].ohm) / 100.0;
        (0..100).find_map(|_| {
            self.heaters[channel].ohm += step;
            self.drive(volt, 1)
        })
    }

    /// Gives all heaters this resistance.
    pub(crate) fn set_resistances(&mut self, ohm: f32) {
        self.heaters = self.heaters.map(|heater| Heater { ohm, ..heater });
    }

    /// Lets the heaters be checked, and cool.
    pub(crate) fn start(&mut self) {
        for _ in 0..START_TICKS {
            self.tick(Setpoint::Off);
        }
        assert!(!self.protection.is_starting());
    }

    pub(crate) fn driving(ohm: [f32; CHANNELS], volt: f32) -> Self {
        let mut bench = Self::new(ohm);
        bench.start();
        bench.protection.command(Lease::FOREVER).expect("no fault");
        assert_eq!(bench.drive(volt, 100), None);
        bench
    }
}
