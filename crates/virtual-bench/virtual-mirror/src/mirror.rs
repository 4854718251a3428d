//! The mirror in time.

mod plate;
mod step_control;
mod system;

use crate::config::{ConfigError, MirrorConfig};
use crate::effects::structure::reconstruct;
use crate::per_actuator::PerActuator;
use crate::state::State;
use crate::thermal::Drive;
use step_control::{SHORTEST_S, StepControl};
use system::{StateVector, System};

/// Time that passes for none (s).
const NO_TIME_S: f64 = 1e-12;
/// Longest time that one call lets pass (s): a mirror settles in minutes, and no call may hang.
const DAY_S: f64 = 86_400.0;
/// What rounding may leave of a duration, as a part of it.
const ROUNDING: f64 = 1e-12;

/// A mirror being driven.
///
/// The `System` takes the `StateVector` `now` to `trial`, step by step; the step control says how far.
#[derive(Clone, Debug)]
pub struct VirtualMirror {
    system: System,
    now: StateVector,
    /// Where the step that is being tried leads.
    trial: StateVector,
    step_control: StepControl,
    drive: PerActuator,
    drive_limit_v: f64,
}

impl VirtualMirror {
    /// A mirror at rest: 0 V for ever.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range.
    pub fn new(config: &MirrorConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let config = &reconstruct(config);
        let system = System::new(config);
        let now = system.at_rest(&config.effects);
        Ok(Self {
            trial: now.clone(),
            now,
            step_control: StepControl::new(system.longest_step_s()),
            system,
            drive: PerActuator::ZERO,
            drive_limit_v: config.drive_limit_v,
        })
    }

    /// Time since the mirror was made (s).
    pub fn time_s(&self) -> f64 {
        self.now.time_s
    }

    /// Holds `drive_v` (V) for one tick of `dt_s` seconds: [`advance`](Self::advance) under the name a control loop
    /// expects, and as exact.
    pub fn step(&mut self, drive_v: [f64; 4], dt_s: f64) {
        self.advance(drive_v, dt_s);
    }

    /// Holds `drive_v` (V) for `duration_s` seconds.
    ///
    /// A drive beyond the rails is held at them, NaN counts as 0 V, and a negative drive heats like a positive one. A
    /// duration below a picosecond, or not finite, passes no time, but the drive is applied; one beyond a day counts as a
    /// day.
    pub fn advance(&mut self, drive_v: [f64; 4], duration_s: f64) {
        self.integrate(Drive::held(self.admit(drive_v)), duration_s);
    }

    /// Moves the drive in a straight line from where it is to `drive_v` (V) within `duration_s` seconds.
    pub fn advance_ramp(&mut self, drive_v: [f64; 4], duration_s: f64) {
        let drive = Drive {
            from: self.drive,
            to: self.admit(drive_v),
        };
        self.integrate(drive, duration_s);
    }

    /// Brings the mirror to a room, or an oven, `rise_k` above the one that it was made in (K). All of the mirror is that
    /// much warmer at once; what the drives and a drifting room add counts from there. Not finite counts as 0.
    pub fn set_ambient(&mut self, rise_k: f64) {
        let rise_k = if rise_k.is_finite() { rise_k } else { 0.0 };
        self.system.set_ambient(&mut self.now, rise_k);
    }

    /// Makes the air take `factor` times the heat that it took when the mirror was made: a draught, another pressure. What is
    /// not finite, or negative, counts as 1.
    pub fn set_air_loss(&mut self, factor: f64) {
        let is_air = factor.is_finite() && factor >= 0.0;
        self.system
            .set_air_loss(&mut self.now, if is_air { factor } else { 1.0 });
    }

    /// Becomes the mirror of `config`, as one that ages does: what is warm stays warm, what is remembered stays remembered, and
    /// the room is the one that it was. Where its beams are cut into other cells it is at rest.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range; the mirror is as it was then.
    pub fn become_mirror(&mut self, config: &MirrorConfig) -> Result<(), ConfigError> {
        config.check()?;
        let config = &reconstruct(config);
        let mut system = System::new(config);
        system.take_over(&self.system, &mut self.now);
        self.trial = self.now.clone();
        self.system = system;
        self.drive_limit_v = config.drive_limit_v;
        Ok(())
    }

    /// Moves the stage that the whole mirror is on: the sensor sees its target `um` further in the direction of the
    /// substrate. Not finite counts as 0.
    pub fn set_stage(&mut self, um: f64) {
        let um = if um.is_finite() { um } else { 0.0 };
        self.system.plate.set_stage(um * 1e-6);
    }

    /// What can be seen now.
    pub fn state(&self) -> State {
        self.system.seen(&self.now, self.drive)
    }

    fn admit(&self, drive: [f64; 4]) -> PerActuator {
        let limit = self.drive_limit_v;
        PerActuator(drive.map(|volts| {
            if volts.is_nan() {
                0.0
            } else {
                volts.clamp(-limit, limit)
            }
        }))
    }

    fn integrate(&mut self, drive: Drive, duration: f64) {
        self.drive = drive.from;
        let passes = (NO_TIME_S..f64::INFINITY).contains(&duration);
        let duration = if passes { duration.min(DAY_S) } else { 0.0 };
        let mut done = 0.0;
        while done < duration {
            let h = self.step_control.next(duration - done);
            let part = drive.part(done / duration, (done + h) / duration);
            let error = self.try_step(&part, h);
            let accepted = error <= 1.0 || h <= SHORTEST_S;
            if accepted {
                self.accept(h);
                done += h;
            }
            self.step_control.adapt(h, error, accepted);
            if duration - done < ROUNDING * duration {
                break;
            }
        }
        self.drive = drive.to;
    }

    /// Computes where a step leads; returns its error in units of what is allowed.
    fn try_step(&mut self, drive: &Drive, h: f64) -> f64 {
        self.system.prepare(&mut self.now, drive.from, h);
        self.system.advance(&self.now, drive, h, &mut self.trial)
    }

    fn accept(&mut self, h: f64) {
        std::mem::swap(&mut self.now, &mut self.trial);
        self.system.settle(&self.now, h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::field::PLATE;

    fn bench() -> VirtualMirror {
        VirtualMirror::new(&MirrorConfig::bench()).expect("valid mirror")
    }

    #[test]
    fn at_rest_what_the_heaters_give_the_air_and_the_substrate_take() {
        let mut mirror = bench();
        mirror.advance([3.0, 2.0, 1.0, 0.0], 100.0);
        let (network, theta) = (&mirror.system.network, &mirror.now.theta);
        let given = (mirror.drive * mirror.drive / network.resistance(theta)).sum();
        let cells = network.cells.iter().zip(theta.beams());
        let air: f64 = cells
            .map(|(cell, theta)| (cell.to_air * *theta).sum())
            .sum();
        let substrate = (network.to_frame * theta.beams()[0]).sum();
        let plate = network.lumps[PLATE].to_room * theta.lumps().0[PLATE];
        // The slowest of the bench mirror's time constants is under a second: after 100 s only rounding is left, and
        // what the error control leaves of a step's 3 mK in 60 K.
        approx::assert_relative_eq!(given, air + substrate + plate, max_relative = 1e-6);
    }

    #[test]
    fn the_steps_are_of_third_order() {
        let end = |steps: u32| {
            let mut mirror = bench();
            let drive = Drive {
                from: PerActuator::ZERO,
                to: PerActuator::splat(1.0),
            };
            let h = 2e-3 / f64::from(steps);
            for step in 0..steps {
                let at = |step: u32| f64::from(step) / f64::from(steps);
                mirror.try_step(&drive.part(at(step), at(step + 1)), h);
                mirror.accept(h);
            }
            mirror.now.theta.beams()[10].0[0]
        };
        let exact = end(1024);
        let ratio = (end(8) - exact) / (end(16) - exact);
        // 2^3, as far as the fourth order leaves it; a method of second order divides by 4.
        assert!(
            (6.0..11.0).contains(&ratio),
            "halving the step divides the error by {ratio}"
        );
    }

    #[test]
    fn a_step_that_is_tried_and_not_accepted_leaves_no_trace() {
        let drive = Drive::held(PerActuator::splat(2.0));
        let (mut straight, mut hesitant) = (bench(), bench());
        for h in [0.3, 0.01, 2e-3] {
            hesitant.try_step(&drive, h);
        }
        for mirror in [&mut straight, &mut hesitant] {
            mirror.try_step(&drive, 1e-3);
            mirror.accept(1e-3);
        }
        assert_eq!(straight.state(), hesitant.state());
        assert_eq!(straight.time_s(), 1e-3);
    }
}
