//! The control step: the stages in turn.

use crate::CHANNELS;
use crate::actuator::{Actuator, Rails};
use crate::calibration::{Calibration, Parts};
use crate::codes::PwmCode;
use crate::heat::HeatInverse;
use crate::lag::TURNS;
use crate::limits::{Limit, Limits};
use crate::memory::{MemoryInverse, MemoryState, TURNS as MEMORY_TURNS};
use crate::path::Path;
use crate::plate::{PlateInverse, Pose};
use crate::resistance::ActuatorSense;
use crate::units::{Ampere, Micrometre, Radian, Volt};

/// What the controller is asked to do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Setpoint {
    /// Zero drive on all actuators.
    #[default]
    Off,
    /// The plate to this pose, on a path that does not make the mirror ring.
    Position(Pose),
    /// A path that comes tick by tick: at the end of this tick the plate shall be here.
    Track(Pose),
    /// These voltages, actuator by actuator.
    Drive([Volt; CHANNELS]),
}

impl Setpoint {
    /// [`Setpoint::Position`] of a level plate.
    pub fn position(z: Micrometre) -> Self {
        Self::Position(z.into())
    }

    /// [`Setpoint::Track`] of a level plate.
    pub fn track(z: Micrometre) -> Self {
        Self::Track(z.into())
    }
}

/// The target of no path: it is no pose that is asked for twice, so the next one is planned for.
const NOWHERE: Pose = Pose {
    z: Micrometre(f32::NAN),
    tilt_x: Radian(0.0),
    tilt_y: Radian(0.0),
};

/// The outcome of one control step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// Voltages to drive from now on.
    pub drives: [Volt; CHANNELS],
    /// The codes that make them; their mean does, a single one is rounded.
    pub codes: [PwmCode; CHANNELS],
    /// What the currents told of each actuator, where they told anything.
    pub sense: [Option<ActuatorSense>; CHANNELS],
    /// What kept the drives from being what was asked.
    pub limits: Limits,
}

/// The four actuators under one calibration.
#[derive(Debug)]
pub struct Controller<'a> {
    calibration: &'a mut Calibration,
    heat: HeatInverse,
    memory: MemoryInverse,
    rails: Rails,
    plate: PlateInverse,
    /// Displacement at which the first actuator is as hot as is allowed.
    hottest: Micrometre,
    /// Where the path leads, and what limited that.
    target: Pose,
    target_limits: Limits,
    path: Path,
    remembered: [MemoryState; CHANNELS],
    actuators: [Actuator; CHANNELS],
    /// Where each actuator was when it was looked at last, while voltages are asked for.
    seen: [f32; CHANNELS],
    /// Counts the turns of what is not done at every tick: one actuator's at a time.
    turn: usize,
    /// What came of it. It is lent and not given, for it is as much to copy as an actuator is to compute.
    step: Step,
}

impl<'a> Controller<'a> {
    /// A controller that inverts `calibration`, of a mirror at rest. The calibration is lent, because it
    /// is large and exchanged in place.
    pub fn new(calibration: &'a mut Calibration) -> Self {
        let parts = calibration.parts();
        let memory = MemoryInverse::new(&parts.memory);
        Self {
            heat: HeatInverse::new(&parts.heat),
            actuators: parts.actuators.each_ref().map(Actuator::new),
            rails: Rails::new(parts),
            plate: PlateInverse::new(&parts.plate, calibration.max_position()),
            hottest: hottest(parts),
            target: NOWHERE,
            target_limits: Limits::NONE,
            path: Path::new(&parts.path),
            remembered: core::array::from_fn(|_| memory.at_rest()),
            memory,
            seen: Default::default(),
            turn: 0,
            step: Step::default(),
            calibration,
        }
    }

    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration {
        self.calibration
    }

    /// Inverts `calibration` from now on, and returns the one before. The history under that one means
    /// nothing now: the mirror is taken to be at rest.
    pub fn exchange(&mut self, calibration: &'a mut Calibration) -> &'a mut Calibration {
        let before = core::mem::replace(self, Self::new(calibration));
        before.calibration
    }

    /// Whether zero drive changes nothing any more: what is left of heat and memory is below a thousandth of a kelvin and
    /// of a micrometre, a fifth of what the core's arithmetic may be off by (`docs/requirements.md`).
    pub fn is_at_rest(&self) -> bool {
        const LEAST: f32 = 1e-3;
        let actuators = self.actuators.iter();
        let mut heat = actuators.map(|actuator| HeatInverse::is_at_rest(&actuator.heat, LEAST));
        let mut remembered = self.remembered.iter();
        heat.all(|is_at_rest| is_at_rest)
            && remembered.all(|state| self.memory.is_at_rest(state, LEAST))
    }

    /// Whether the calibration knows the plate's levers; without them [`Self::pose`] has no tilts.
    pub fn knows_tilts(&self) -> bool {
        self.plate.is_known()
    }

    /// Where the plate is on its way: where it is asked to be at the end of the last tick, or, while voltages are asked for,
    /// where they take it, to within its memory.
    pub fn pose(&self) -> Pose {
        self.plate.pose(self.path.now())
    }

    /// One control tick.
    ///
    /// `applied` are the voltages that were driven while `currents` were sensed. Every input is
    /// answered: what is not finite or out of range is limited, and named in [`Step::limits`].
    pub fn step(
        &mut self,
        setpoint: Setpoint,
        applied: [Volt; CHANNELS],
        currents: [Ampere; CHANNELS],
    ) -> &Step {
        let step = &mut self.step;
        step.limits = Limits::NONE;
        for (i, actuator) in self.actuators.iter_mut().enumerate() {
            step.sense[i] = actuator.sense(applied[i], currents[i], &mut step.limits);
        }
        match setpoint {
            Setpoint::Off => self.drive([Volt(0.0); CHANNELS]),
            Setpoint::Drive(drives) => self.drive(drives),
            Setpoint::Position(pose) => {
                if pose != self.target {
                    self.target = pose;
                    self.target_limits = Limits::NONE;
                    let target = self.plate.positions(&pose, &mut self.target_limits);
                    self.path.plan(&target);
                }
                step.limits = step.limits.union(self.target_limits);
                self.path.advance();
                self.go_on();
            }
            Setpoint::Track(pose) => {
                let positions = self.plate.positions(&pose, &mut step.limits);
                self.target = NOWHERE;
                self.path.follow(&positions);
                self.go_on();
            }
        }
        self.heat
            .advance_slow(&mut self.actuators[self.turn % CHANNELS].heat);
        self.turn = (self.turn + 1) % MEMORY_TURNS;
        &self.step
    }

    /// All four actuators to where the path is.
    fn go_on(&mut self) {
        let step = &mut self.step;
        let positions = self.path.now();
        let turn = self.turn % CHANNELS;
        let state = &mut self.remembered[turn];
        self.memory
            .advance(state, self.turn / CHANNELS, Micrometre(positions[turn]));
        let calibrations = self.calibration.actuators();
        for (i, actuator) in self.actuators.iter_mut().enumerate() {
            let mut x = self.remembered[i].displacement(Micrometre(positions[i]));
            if x.0 > self.hottest.0 {
                x = self.hottest;
                step.limits.insert(Limit::TemperatureHigh);
            }
            let target = calibrations[i].shape.temperature_rise(x);
            let drive = actuator.heat_to(target, &self.heat, &self.rails, &mut step.limits);
            step.drives[i] = drive;
            step.codes[i] = actuator.code(drive, &self.rails);
        }
    }

    /// Voltages, and the mirror followed to where they take it.
    fn drive(&mut self, drives: [Volt; CHANNELS]) {
        // One actuator a tick: reading a table forward is slow, and the mirror is slower.
        let turn = self.turn % CHANNELS;
        let shape = &self.calibration.actuators()[turn].shape;
        let seen = shape.position(self.actuators[turn].rise());
        self.seen[turn] = seen.0;
        self.target = NOWHERE;
        self.path.follow(&self.seen);
        // Hysteresis and creep are a few percent of a position; that this one is before them is a few
        // percent of that.
        self.memory
            .advance(&mut self.remembered[turn], self.turn / CHANNELS, seen);
        let step = &mut self.step;
        for (i, actuator) in self.actuators.iter_mut().enumerate() {
            let drive = actuator.drive(drives[i], &self.heat, &self.rails, &mut step.limits);
            step.drives[i] = drive;
            step.codes[i] = actuator.code(drive, &self.rails);
        }
    }
}

/// The displacement at which the first actuator reaches the highest temperature rise; infinite where none
/// does within its table.
fn hottest(parts: &Parts) -> Micrometre {
    let limit = parts.bounds.rise;
    let shapes = parts.actuators.iter().map(|actuator| &actuator.shape);
    let reached = shapes.filter(|shape| shape.temperature_rise(shape.top()).0 > limit.0);
    let positions = reached.map(|shape| shape.position(limit).0);
    Micrometre(positions.fold(
        f32::INFINITY,
        |lowest, z| if z < lowest { z } else { lowest },
    ))
}

// The slow lags of one actuator have their turn at every tick.
const _: () = assert!(CHANNELS == TURNS);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use crate::calibration::{ActuatorCalibration, Heat, Memory};
    use crate::shape::{InverseTable, KNOTS};
    use crate::units::{Kelvin, KelvinPerWatt, Ohm, PerKelvin};
    use proptest::prelude::*;
    use std::boxed::Box;
    use std::vec::Vec;

    /// Ticks of ten seconds.
    const TEN_SECONDS: u32 = 100_000;

    #[test]
    fn a_controller_at_rest_is_the_same_however_long_it_has_been() {
        let mut calibration = Box::new(Calibration::new(parts()).expect("good"));
        let mut controller = Controller::new(&mut calibration);
        assert!(controller.is_at_rest(), "before anything was driven");
        let mut applied = [Volt(0.0); CHANNELS];
        let mut follow = |controller: &mut Controller<'_>, setpoint, ticks: u32| {
            for _ in 0..ticks {
                let step = controller.step(setpoint, applied, [Ampere(0.0); CHANNELS]);
                applied = step.drives;
            }
            applied[0].0
        };
        let there = Setpoint::position(Micrometre(40.0));
        follow(&mut controller, there, 20_000);
        assert!(!controller.is_at_rest(), "it is warm");
        let mut waited = 0;
        while !controller.is_at_rest() {
            follow(&mut controller, Setpoint::Off, TEN_SECONDS);
            waited += 1;
            assert!(waited < 1000, "it never comes to rest");
        }
        let (memory, actuators) = (controller.remembered.clone(), controller.actuators.clone());
        let soon = follow(&mut controller, there, 5_000);
        (controller.remembered, controller.actuators) = (memory, actuators);
        follow(&mut controller, Setpoint::Off, 10 * TEN_SECONDS);
        let late = follow(&mut controller, there, 5_000);
        // 1 um is some 10 mV there, and what is left is 2 nm at most of creep and heat.
        assert!((soon - late).abs() < 1e-4, "{soon} and {late}");
    }

    /// 100 um at 100 K, 400 ohm cold, 560 ohm at the top; nothing takes time.
    fn static_parts() -> Parts {
        let actuator = ActuatorCalibration {
            cold_resistance: Ohm(400.0),
            tcr: PerKelvin(0.004),
            thermal_resistance: KelvinPerWatt(5000.0),
            loss_growth: PerKelvin(0.0),
            shape: InverseTable::new(
                Micrometre(100.0),
                core::array::from_fn(|i| 100.0 * i as f32 / (KNOTS - 1) as f32),
            )
            .expect("rising"),
        };
        Parts {
            actuators: [actuator; CHANNELS],
            heat: Heat::INSTANT,
            memory: Memory::NONE,
            ..parts()
        }
    }

    fn controller(parts: Parts) -> Controller<'static> {
        let calibration = Calibration::new(parts).expect("plausible");
        Controller::new(Box::leak(Box::new(calibration)))
    }

    const NOTHING: ([Volt; CHANNELS], [Ampere; CHANNELS]) =
        ([Volt(0.0); CHANNELS], [Ampere(0.0); CHANNELS]);

    fn step(setpoint: Setpoint) -> Step {
        *controller(static_parts()).step(setpoint, NOTHING.0, NOTHING.1)
    }

    #[test]
    fn a_position_is_driven_with_the_power_that_holds_it() {
        let drive = step(Setpoint::track(Micrometre(50.0))).drives[0].0;
        // 50 K need 10 mW; the heater has 400 ohm still.
        assert!((drive - (10e-3_f32 * 400.0).sqrt()).abs() < 1e-5, "{drive}");
        let mut controller = controller(static_parts());
        let mut settled = |z| {
            let tick =
                |_| *controller.step(Setpoint::position(Micrometre(z)), NOTHING.0, NOTHING.1);
            (0..100).map(tick).last().expect("ticks").drives[0].0
        };
        assert!((settled(50.0) - (10e-3_f32 * 480.0).sqrt()).abs() < 1e-5);
        assert_eq!(settled(0.0), 0.0);
    }

    #[test]
    fn a_position_out_of_range_is_limited_by_name() {
        let limited = |z| step(Setpoint::position(Micrometre(z))).limits;
        assert_eq!(limited(50.0), Limits::NONE);
        assert!(limited(100.1).contains(Limit::PositionHigh));
        assert!(limited(-0.1).contains(Limit::PositionLow));
        assert!(limited(f32::NAN).contains(Limit::NotANumber));
    }

    #[test]
    fn a_drive_above_the_highest_is_limited_by_name() {
        let mut drives = [Volt(1.0); CHANNELS];
        drives[2] = Volt(3.6);
        let step = step(Setpoint::Drive(drives));
        assert_eq!(step.drives[2], Volt(3.5));
        assert_eq!(step.codes[2], PwmCode(3500));
        assert_eq!(step.drives[1], Volt(1.0));
        assert!(step.limits.contains(Limit::DriveHigh));
    }

    #[test]
    fn power_and_temperature_are_limited_by_name() {
        let limited = |change: fn(&mut Parts)| {
            let mut parts = static_parts();
            change(&mut parts);
            let setpoint = Setpoint::track(Micrometre(60.0));
            *controller(parts).step(setpoint, NOTHING.0, NOTHING.1)
        };
        let power = limited(|parts| parts.bounds.power = crate::units::Watt(6e-3));
        assert!(power.limits.contains(Limit::PowerHigh));
        assert!((power.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
        let rise = limited(|parts| parts.bounds.rise = Kelvin(30.0));
        assert!(rise.limits.contains(Limit::TemperatureHigh));
        assert!((rise.drives[0].0 - (6e-3_f32 * 400.0).sqrt()).abs() < 1e-5);
    }

    #[test]
    fn a_mirror_that_cannot_cool_faster_says_so() {
        let mut controller = controller(parts());
        let mut last = |z: f32, ticks: usize| {
            let tick =
                |_| *controller.step(Setpoint::position(Micrometre(z)), NOTHING.0, NOTHING.1);
            (0..ticks).map(tick).last().expect("ticks")
        };
        last(150.0, 10_000);
        let cooling = last(10.0, 60);
        assert!(cooling.limits.contains(Limit::Cooling));
        assert_eq!(cooling.codes, [PwmCode(0); CHANNELS]);
        assert_eq!(last(10.0, 20_000).limits, Limits::NONE);
    }

    #[test]
    fn what_a_bound_held_back_catches_up_without_a_jerk() {
        let mut controller = controller(parts());
        let mut ticks = |z: f32, ticks: usize| -> Vec<(f32, bool)> {
            let mut tick = |_| {
                let setpoint = Setpoint::position(Micrometre(z));
                let limits = controller.step(setpoint, NOTHING.0, NOTHING.1).limits;
                (
                    controller.actuators[0].rise().0,
                    limits.contains(Limit::Cooling),
                )
            };
            (0..ticks).map(&mut tick).collect()
        };
        ticks(170.0, 10_000);
        let fall = ticks(50.0, 1000);
        let last = fall.iter().rposition(|(_, cooling)| *cooling);
        let last = last.expect("it was held back");
        // The last tick that was held back, and the three after it.
        let speed = |tick: usize| fall[tick - 1].0 - fall[tick].0;
        for tick in last..last + 3 {
            let left = speed(tick + 1) / speed(tick);
            assert!(left > 0.7, "{left} of the speed is left after a tick");
        }
    }

    #[test]
    fn the_current_is_read_as_a_thermometer() {
        let currents = [
            Ampere(2.0 / 480.0),
            Ampere(2.0 / 400.0),
            Ampere(0.0),
            Ampere(-1e-6),
        ];
        let step = *controller(static_parts()).step(Setpoint::Off, [Volt(2.0); CHANNELS], currents);
        let rises = step
            .sense
            .map(|actuator| actuator.map(|actuator| actuator.temperature_rise.0.round()));
        assert_eq!(rises, [Some(50.0), Some(0.0), None, None]);
    }

    #[test]
    fn a_heater_of_another_resistance_gets_the_same_power() {
        let mut controller = controller(static_parts());
        let ohm = 1.1 * 480.0;
        let mut applied = [Volt(0.0); CHANNELS];
        for _ in 0..200 {
            let currents = applied.map(|drive| Ampere(drive.0 / ohm));
            let setpoint = Setpoint::position(Micrometre(50.0));
            applied = controller.step(setpoint, applied, currents).drives;
        }
        let power = applied[0].0 * applied[0].0 / ohm;
        assert!((power - 10e-3).abs() < 1e-6, "{power}");
    }

    #[test]
    fn an_implausible_current_is_named_and_not_used() {
        let mut controller = controller(static_parts());
        let setpoint = Setpoint::track(Micrometre(50.0));
        let mut applied = [Volt(0.0); CHANNELS];
        let mut told = false;
        for current in [40e-3, 1e-5].into_iter().cycle().take(100) {
            let step = controller.step(setpoint, applied, [Ampere(current); CHANNELS]);
            told |= step.limits.contains(Limit::ResistanceUnknown);
            applied = step.drives;
        }
        assert!(told);
        assert!((applied[0].0 - (10e-3_f32 * 480.0).sqrt()).abs() < 1e-5);
    }

    fn any_float() -> impl Strategy<Value = f32> {
        any::<u32>().prop_map(f32::from_bits)
    }

    fn any_setpoint() -> impl Strategy<Value = Setpoint> {
        prop_oneof![
            Just(Setpoint::Off),
            any_float().prop_map(|z| Setpoint::position(Micrometre(z))),
            (0.0_f32..200.0).prop_map(|z| Setpoint::position(Micrometre(z))),
            any_float().prop_map(|z| Setpoint::track(Micrometre(z))),
            proptest::array::uniform4(any_float()).prop_map(|v| Setpoint::Drive(v.map(Volt))),
        ]
    }

    proptest! {
        /// And it recovers: whatever came before, a position is driven in the end.
        #[test]
        fn any_bit_pattern_gives_a_drive_within_the_limits(
            ticks in proptest::collection::vec((
                any_setpoint(),
                proptest::array::uniform4(any_float()),
                proptest::array::uniform4(any_float()),
            ), 1..30),
        ) {
            let mut controller = controller(parts());
            for (setpoint, applied, currents) in ticks {
                let step = controller.step(setpoint, applied.map(Volt), currents.map(Ampere));
                for (drive, code) in step.drives.into_iter().zip(step.codes) {
                    prop_assert!((0.0..=3.5).contains(&drive.0), "{drive:?}");
                    prop_assert!(code.0 <= 3500);
                }
            }
            let setpoint = Setpoint::position(Micrometre(100.0));
            let tick = |_| controller.step(setpoint, NOTHING.0, NOTHING.1).drives[0].0;
            let settled = (0..3000).map(tick).last().expect("ticks");
            prop_assert!((1.0..3.0).contains(&settled), "{settled}");
        }

        #[test]
        fn a_higher_position_never_needs_a_lower_drive(a in 0.0_f32..100.0, b in 0.0_f32..100.0) {
            let drive = |z| step(Setpoint::track(Micrometre(z))).drives[0];
            prop_assert!(drive(a.min(b)) <= drive(a.max(b)));
        }
    }
}
