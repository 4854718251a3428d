//! The control core in front of a virtual mirror, without an emulator.
//!
//! The core, the converters' quantisation and noise, and the mirror are those of the emulated board; what
//! is left out is the firmware around them, so that minutes of a mirror take seconds. Of the board's
//! analogue half the output filter is left out, as on the emulated board: the two poles at 2 kHz of a real one add a lag
//! of 2 / (2 pi 2 kHz) = 0.159 ms, which an identification on that board finds as part of the fastest thermal pole.
//!
//! - [`Loop`] is a tick after a tick;
//! - [`calibrate`] calibrates a mirror that nobody has told it of, by the procedure of `host-tool calibrate`;
//! - [`figures`] are what the positioning reaches then;
//! - [`surroundings`] are what it reaches in another room;
//! - [`uncertainty`] is whether its intervals hold what they promise;
//! - [`precision`] tells how far the core's f32 arithmetic is from the same chain in f64.

mod calibrate;
mod double;
pub mod drift;
pub mod figures;
mod limit;
mod mirror;
mod player;
pub mod pose;
mod precision;
mod sine;
pub mod surroundings;
pub mod uncertainty;

pub use calibrate::{CalibrateError, calibrate, calibrate_then};
pub use mirror::{scattered, usual_mirror};
pub use precision::{Precision, precision};

use calibration::PlatePose;
use control_core::{
    AdcCode, Ampere, CHANNELS, Calibration, Controller, CurrentSense, Estimate, Limits, Micrometre,
    Pose, PwmCode, Radian, Retained, SenseCalibration, Setpoint, TICK, Uncertainty, Volt,
};
use emulated_board::{Device, Electronics, Mirror};
use virtual_mirror::{ConfigError, MirrorConfig, VirtualMirror};

/// Length of a tick (s).
pub const TICK_S: f64 = TICK.0 as f64;

/// Core, converters and mirror.
pub struct Loop<'a, M = VirtualMirror> {
    controller: Controller<'a>,
    electronics: Electronics,
    sense: CurrentSense,
    mirror: M,
    applied: [PwmCode; CHANNELS],
    /// What the codes' mean is to be (V).
    drives: [Volt; CHANNELS],
    currents: [Ampere; CHANNELS],
}

impl<'a, M: Mirror> Loop<'a, M> {
    /// A mirror at rest on a board that uses `calibration`.
    ///
    /// # Errors
    /// Where a number of `config` is out of range.
    pub fn new(
        calibration: &'a mut Calibration,
        config: &impl Device<Mirror = M>,
    ) -> Result<Self, ConfigError> {
        Ok(Self::of(calibration, config.seed(), config.make()?))
    }

    /// A mirror as it is on a board that has just been switched on. `seed`: of the board's tolerances.
    pub fn of(calibration: &'a mut Calibration, seed: u64, mirror: M) -> Self {
        let mut electronics = Electronics::new(seed);
        Self {
            controller: Controller::new(calibration),
            sense: zeroed(&mut electronics),
            electronics,
            mirror,
            applied: [PwmCode(0); CHANNELS],
            drives: [Volt(0.0); CHANNELS],
            currents: [Ampere(0.0); CHANNELS],
        }
    }

    /// What the board retains across a reset.
    pub fn retained(&self) -> [Retained; CHANNELS] {
        std::array::from_fn(|actuator| self.controller.retained(actuator))
    }

    /// Goes on with what the board retained; to be called before the first tick.
    pub fn recall(&mut self, retained: &[Retained; CHANNELS]) {
        self.controller.recall(retained);
    }

    /// One tick; returns where the mirror is at its end (um), and what limited it.
    pub fn tick(&mut self, setpoint: Setpoint) -> (f64, Limits) {
        let applied = self.applied.map(PwmCode::drive);
        let step = self.controller.step(setpoint, applied, self.currents);
        let (codes, limits) = (step.codes, step.limits);
        self.drives = step.drives;
        self.controller.foresee();
        let drive_v = codes.map(|code| self.electronics.drive_v(code.0));
        // The currents follow the drive at once, the mirror has not moved yet.
        self.mirror.step(drive_v, 0.0);
        let current_a = self.mirror.state().current_a;
        let code = |i: usize| AdcCode(self.electronics.sense_code(i, current_a[i]));
        self.currents = self.sense.currents(std::array::from_fn(code));
        self.applied = codes;
        self.mirror.step(drive_v, TICK_S);
        (self.mirror.state().z_um, limits)
    }

    /// Ticks by which a way that is tracked comes late.
    pub fn track_delay_ticks(&self) -> f32 {
        self.controller.track_delay_ticks()
    }

    /// Goes to `z_um` and stays for so long; returns where the mirror is then (um), as the mean of the last
    /// 10 ms.
    pub fn hold(&mut self, z_um: f64, seconds: f64) -> f64 {
        let level = PlatePose {
            z_um,
            ..PlatePose::default()
        };
        self.hold_pose(&level, seconds).z_um
    }

    /// Goes to a pose and stays for so long; returns the pose of the plate then, as the mean of the last 10 ms.
    pub fn hold_pose(&mut self, asked: &PlatePose, seconds: f64) -> PlatePose {
        const READ: usize = 100;
        let setpoint = Setpoint::Position(core_pose(asked));
        let ticks = (seconds / TICK_S).round() as usize;
        let share = 1.0 / READ.min(ticks) as f64;
        let mut mean = PlatePose::default();
        for tick in 0..ticks {
            self.tick(setpoint);
            if tick + READ >= ticks {
                let state = self.mirror.state();
                mean.z_um += share * state.z_um;
                mean.tilt_x_rad += share * state.tilt_x_deg.to_radians();
                // The virtual mirror counts this one left-handed.
                mean.tilt_y_rad -= share * state.tilt_y_deg.to_radians();
            }
        }
        mean
    }

    /// Where the core says that the plate is (um).
    pub fn told_um(&self) -> f64 {
        f64::from(self.controller.pose().z.0)
    }

    /// What is driven now, before it is rounded to codes (V).
    pub fn drive_v(&self) -> [f64; CHANNELS] {
        self.drives.map(|drive| f64::from(drive.0))
    }

    /// Temperature rises that the heaters' resistances tell (K), where they tell any.
    pub fn sensed_k(&self) -> [Option<f64>; CHANNELS] {
        let sense = self.controller.latest().sense;
        sense.map(|it| it.map(|it| f64::from(it.temperature_rise.0)))
    }

    /// Uses `calibration` from now on, and takes the mirror to be at rest; returns the calibration before.
    pub fn exchange(&mut self, calibration: &'a mut Calibration) -> &'a mut Calibration {
        self.controller.exchange(calibration)
    }

    /// Brings the mirror to a room that is so much warmer than where it was calibrated (K).
    pub fn set_ambient(&mut self, rise_k: f64) {
        self.mirror.set_ambient(rise_k);
    }

    /// Makes the air take so many times the heat that it took.
    pub fn set_air_loss(&mut self, factor: f64) {
        self.mirror.set_air_loss(factor);
    }

    /// Compensates the surroundings from now on, or leaves the mirror to them.
    pub fn compensate_surroundings(&mut self, is_used: bool) {
        self.controller.compensate_surroundings(is_used);
    }

    /// What the core knows of the surroundings.
    pub fn surroundings(&self) -> Option<Estimate> {
        self.controller.surroundings().copied()
    }

    /// Evidence that a heater has drifted, as a part of what is told.
    pub fn drift(&self) -> f32 {
        self.controller.drift()
    }

    /// How far the core says that the plate may be from where it is asked to be.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        self.controller.uncertainty()
    }

    /// Where the core says that the range begins (um).
    pub fn lowest_um(&self) -> f64 {
        f64::from(self.controller.lowest().0)
    }

    /// How long the core says that it will take until it is there (s).
    pub fn settles_in_s(&self) -> Option<f64> {
        self.controller.settles_in().map(|time| f64::from(time.0))
    }

    /// The mirror as it is now.
    pub fn mirror(&self) -> &M {
        &self.mirror
    }

    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration {
        self.controller.calibration()
    }
}

impl Loop<'_> {
    /// Makes the mirror what it has become with age, as warm as it is.
    ///
    /// # Errors
    /// Where a number of `config` is out of range.
    pub fn age(&mut self, config: &MirrorConfig) -> Result<(), ConfigError> {
        self.mirror.become_mirror(config)
    }
}

/// A pose in the core's numbers.
fn core_pose(pose: &PlatePose) -> Pose {
    Pose {
        z: Micrometre(pose.z_um as f32),
        tilt_x: Radian(pose.tilt_x_rad as f32),
        tilt_y: Radian(pose.tilt_y_rad as f32),
    }
}

/// The current sense with its zero taken, as a calibration of the board begins; its gain is off.
fn zeroed(electronics: &mut Electronics) -> CurrentSense {
    const READINGS: usize = 500;
    let designed = CurrentSense::new(&SenseCalibration::DESIGNED);
    let mut sum_a = [0.0; CHANNELS];
    for _ in 0..READINGS {
        let read = designed.currents(std::array::from_fn(|i| {
            AdcCode(electronics.sense_code(i, 0.0))
        }));
        sum_a = std::array::from_fn(|i| sum_a[i] + read[i].0);
    }
    let zero = sum_a.map(|sum| Ampere(sum / READINGS as f32));
    let sense = SenseCalibration::new(zero, [1.0; CHANNELS]);
    CurrentSense::new(&sense.unwrap_or(SenseCalibration::DESIGNED))
}
