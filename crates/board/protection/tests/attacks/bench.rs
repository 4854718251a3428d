//! A board of protection alone, in front of four beams.

use control_core::{
    AdcCode, Ampere, CHANNELS, Calibration, CurrentSense, PwmCode, SenseCalibration, Setpoint,
    SupplyCode, Volt,
};
use protection::{Fault, Lease, Protection, Reading};
use rand_chacha::ChaCha8Rng;

use crate::common::parts;
use crate::plant::{Beam, Surroundings};

/// Numbers of a calibration that a mirror on this board's line may have, as the firmware is given them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claim {
    pub(crate) cold_ohm: f64,
    pub(crate) tcr: f64,
    pub(crate) drive_v: f64,
    pub(crate) rise_k: f64,
    /// Zero and gain that the current sense is said to have.
    pub(crate) sense: (f64, f64),
}

/// The factory's.
pub(crate) const FACTORY: Claim = Claim {
    cold_ohm: 360.0,
    tcr: 3.92e-3,
    drive_v: 3.5,
    rise_k: 135.0,
    sense: (0.0, 1.0),
};

impl Claim {
    /// The sense's calibration, if the board takes it.
    pub(crate) fn sense(self) -> Option<SenseCalibration> {
        let (zero_a, gain) = self.sense;
        SenseCalibration::new([Ampere(zero_a as f32); CHANNELS], [gain as f32; CHANNELS])
    }

    /// As the board takes it, if it does.
    pub(crate) fn accepted(self) -> Option<Calibration> {
        let Self {
            cold_ohm,
            tcr,
            drive_v,
            rise_k,
            ..
        } = self;
        Calibration::new(parts(
            cold_ohm as f32,
            tcr as f32,
            drive_v as f32,
            rise_k as f32,
        ))
        .ok()
    }
}

/// The board's side of a run.
pub(crate) struct Board {
    pub(crate) protection: Protection,
    sense: CurrentSense,
    beams: [Beam; CHANNELS],
    applied: [Volt; CHANNELS],
    highest_v: f64,
    /// Stages that do not follow.
    pub(crate) stuck_v: [Option<f64>; CHANNELS],
    pub(crate) trips: Vec<Fault>,
    pub(crate) hottest_k: f64,
}

impl Board {
    /// In front of beams of the line, drawn within its tolerances.
    pub(crate) fn of_the_line(surroundings: Surroundings, rng: &mut ChaCha8Rng) -> Self {
        let beams = std::array::from_fn(|_| Beam::draw(surroundings, rng));
        let factory = FACTORY.accepted().expect("the factory's is accepted");
        Self {
            protection: Protection::new(&factory),
            sense: CurrentSense::new(&SenseCalibration::DESIGNED),
            beams,
            applied: [Volt(0.0); CHANNELS],
            highest_v: FACTORY.drive_v,
            stuck_v: [None; CHANNELS],
            trips: Vec::new(),
            hottest_k: 0.0,
        }
    }

    pub(crate) fn use_calibration(&mut self, calibration: &Calibration, sense: SenseCalibration) {
        self.protection.recalibrate(calibration);
        self.use_numbers(calibration, sense);
    }

    /// The processor is reset, and finds this calibration stored.
    pub(crate) fn restart(&mut self, calibration: &Calibration, sense: SenseCalibration) {
        self.protection = Protection::new(calibration);
        self.applied = [Volt(0.0); CHANNELS];
        self.use_numbers(calibration, sense);
    }

    fn use_numbers(&mut self, calibration: &Calibration, sense: SenseCalibration) {
        self.highest_v = f64::from(calibration.max_drive().0);
        self.sense = CurrentSense::new(&sense.with_designed_gain());
    }

    /// A tick in which the host wants `volts` on all channels, clears what has tripped, and renews.
    pub(crate) fn tick(&mut self, volts: f64) {
        if let Some(fault) = self.protection.first_cause() {
            self.trips.push(fault);
            self.protection.clear();
        }
        self.tick_without_clearing(volts);
    }

    /// The same of a host that leaves a trip as it is.
    pub(crate) fn tick_without_clearing(&mut self, volts: f64) {
        let _ = self.protection.command(Lease::FOREVER);
        let codes = std::array::from_fn(|i| {
            let code = self.beams[i].tick(i, self.stuck_v[i].unwrap_or(self.applied[i].0.into()));
            AdcCode(code)
        });
        for beam in &self.beams {
            self.hottest_k = self.hottest_k.max(beam.hottest_k());
        }
        let currents = self.sense.currents(codes);
        let reading = Reading {
            codes,
            currents,
            supply: SupplyCode::from_millivolt(5000),
            missed_ticks: 0,
            is_over_voltage: false,
        };
        let wanted = Setpoint::Drive([Volt(volts as f32); CHANNELS]);
        self.applied = match self.protection.tick(wanted, self.applied, &reading) {
            Setpoint::Drive(drives) => drives.map(|drive| {
                let drive = f64::from(drive.0).clamp(0.0, self.highest_v);
                PwmCode::nearest(Volt(drive as f32)).drive()
            }),
            _ => [Volt(0.0); CHANNELS],
        };
    }
}
