//! The control step: the stages in turn.

use core::hint::cold_path;

use crate::CHANNELS;
use crate::actuator::{Actuator, Rails, catch_up_time};
use crate::calibration::{Calibration, Parts};
use crate::codes::PwmCode;
use crate::design::TICK;
use crate::heat::inherited::PolesBefore;
use crate::heat::{HeatInverse, SharedHeat};
use crate::lag::TURNS;
use crate::limits::{Limit, Limits};
use crate::memory::{MemoryInverse, Successors, TURNS as MEMORY_TURNS};
use crate::path::PathPlanner;
use crate::plate::{PlateInverse, Pose};
use crate::resistance::ActuatorSense;
use crate::settling::Decay;
use crate::shaper::Shaper;
use crate::surroundings::{Estimate, PERIOD, Surroundings};
use crate::uncertainty::Budget;
use crate::units::{Ampere, Kelvin, Micrometre, Radian, Volt};

mod exchange;
mod foresight;
mod listening;
mod retained;

pub use retained::Retained;

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

/// So much below rest, or bent by its surroundings, an actuator may be without a word: 0.05 um of a usual mirror, its static error.
const UNNOTICED: Kelvin = Kelvin(0.03);

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
    /// What the currents told of each actuator in its last turn, one tick in four, where they told anything.
    pub sense: [Option<ActuatorSense>; CHANNELS],
    /// What kept the drives from being what was asked.
    pub limits: Limits,
}

/// The four actuators under one calibration.
// What every tick reads of all four comes first, where one instruction reaches it (VLDR: 1020 bytes).
#[derive(Debug)]
#[repr(C)]
pub struct Controller<'a> {
    actuators: [Actuator; CHANNELS],
    heat: HeatInverse,
    rails: Rails,
    /// The displacement that no actuator goes beyond, and what limits one there.
    highest: Micrometre,
    highest_limits: Limits,
    /// What limits one that is to be below rest: the surroundings where they bend it alone, else what creep and hysteresis hold up.
    lowest_limits: Limits,
    /// What came of it. It is lent and not given, for it is as much to copy as an actuator is to compute.
    step: Step,
    /// The rises of the beams that positions ask for in the room of the calibration.
    asked: [Kelvin; CHANNELS],
    path: PathPlanner,
    /// What the four share of their heat.
    shared: SharedHeat,
    /// Counts the turns of what is not done at every tick: one actuator's at a time.
    turn: usize,
    surroundings: Surroundings,
    plate: PlateInverse,
    memory: MemoryInverse,
    calibration: &'a mut Calibration,
    /// Where the path leads, and what limited that.
    target: Pose,
    target_limits: Limits,
    /// What limits by what the currents told.
    sense_limits: Limits,
    /// Where each actuator was when it was looked at last, while voltages are asked for.
    seen: [f32; CHANNELS],
    /// For ways that are tracked.
    shaper: Shaper,
    /// What is not known of where the plate is.
    budget: Budget,
    decay: Decay,
    /// Ticks that each actuator still needs.
    arrivals: [f32; CHANNELS],
    /// The heating with which each is on its way, or stays.
    heatings: [Kelvin; CHANNELS],
    /// Whether voltages are asked for, and no position: the surroundings are not compensated then.
    is_by_voltage: bool,
    /// Where the surroundings alone hold each actuator.
    lowest: [Micrometre; CHANNELS],
    /// Ticks since the path was there, as far as they are counted.
    since_arrival: u16,
    next: Option<Next<'a>>,
}

/// A calibration that takes the place of the one in use.
#[derive(Debug)]
struct Next<'a> {
    calibration: &'a mut Calibration,
    /// What is exchanged already: stages, and of the memory each actuator's.
    exchanged: usize,
    /// What is to take the place of the heat's inverse.
    heat: Option<(HeatInverse, PolesBefore)>,
    /// The memory before, while actuators have still to inherit it.
    memory: Option<(MemoryInverse, Successors)>,
}

impl<'a> Controller<'a> {
    /// A controller that inverts `calibration`, of a mirror at rest. The calibration is lent, because it
    /// is large and exchanged in place.
    pub fn new(calibration: &'a mut Calibration) -> Self {
        let parts = calibration.parts();
        let memory = MemoryInverse::new(&parts.memory, parts.bounds.drive);
        let (highest, highest_limits) = highest(parts);
        Self {
            heat: HeatInverse::new(&parts.heat, parts.shared_gains()),
            shared: SharedHeat::default(),
            actuators: parts
                .actuators
                .each_ref()
                .map(|actuator| Actuator::new(actuator, memory.at_rest())),
            rails: Rails::new(parts),
            surroundings: Surroundings::new(parts),
            asked: Default::default(),
            plate: PlateInverse::new(&parts.plate, calibration.max_position()),
            highest,
            highest_limits,
            lowest_limits: Limits::NONE,
            target: NOWHERE,
            target_limits: Limits::NONE,
            sense_limits: Limits::NONE,
            path: PathPlanner::new(&parts.path),
            budget: Budget::new(parts, &memory),
            memory,
            seen: Default::default(),
            turn: 0,
            decay: Decay::new(&parts.heat, catch_up_time(parts)),
            arrivals: Default::default(),
            heatings: Default::default(),
            is_by_voltage: true,
            lowest: [Micrometre(0.0); CHANNELS],
            since_arrival: 0,
            shaper: Shaper::new(&parts.path.resonance),
            next: None,
            step: Step::default(),
            calibration,
        }
    }

    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration {
        self.calibration
    }

    /// What the resistances tell of the surroundings; `None` under a calibration that does not know them.
    pub fn surroundings(&self) -> Option<&Estimate> {
        self.surroundings.estimate()
    }

    /// Evidence that a heater tells otherwise than at calibration, as a part of what is told as [`Limit::CalibrationDrifted`].
    pub fn drift(&self) -> f32 {
        self.surroundings.drift()
    }

    /// Whether the heaters are to be read at rest, now or some seconds later: they differ from each other otherwise than at calibration, and it is
    /// not decided yet whether that is another mirror or heat from before the start, or they were too warm for any reading so far.
    pub fn asks_for_heaters(&self) -> bool {
        self.surroundings.are_heaters_asked()
    }

    /// Whether the surroundings are compensated in positions.
    pub fn compensates_surroundings(&self) -> bool {
        self.surroundings.is_used()
    }

    /// Compensates the surroundings in positions from now on, or leaves the mirror to them.
    pub fn compensate_surroundings(&mut self, is_used: bool) {
        self.surroundings.compensate(is_used);
    }

    /// So many ticks pass in which nothing is driven and nothing sensed.
    #[inline(never)]
    pub fn rest(&mut self, ticks: u16) {
        self.surroundings.rest(ticks);
        self.budget.rest(&self.memory, ticks);
        for actuator in &mut self.actuators {
            self.memory.rest(&mut actuator.memory, ticks);
        }
    }

    /// Whether zero drive changes nothing any more: what is left of heat and memory is below a thousandth of a kelvin and
    /// of a micrometre, a fifth of what the core's arithmetic may be off by (`docs/requirements.md`).
    pub fn is_at_rest(&self) -> bool {
        const LEAST: f32 = 1e-3;
        self.actuators.iter().all(|actuator| {
            HeatInverse::is_at_rest(&actuator.heat, &self.shared, LEAST)
                && self.memory.is_at_rest(&actuator.memory, LEAST)
        })
    }

    /// Whether the calibration knows the plate's levers; without them [`Self::pose`] has no tilts.
    pub fn knows_tilts(&self) -> bool {
        self.plate.is_known()
    }

    /// Where the plate is on its way: where it is asked to be at the end of the last tick, or, while voltages are asked for,
    /// where they take it.
    pub fn pose(&self) -> Pose {
        self.plate.pose(&self.path.place())
    }

    /// Ticks by which a way comes late that is tracked ([`Setpoint::Track`]): who knows what comes asks for it so much ahead.
    pub fn track_delay_ticks(&self) -> f32 {
        let plate = self.calibration.parts().path.resonance.delay();
        self.shaper.delay_ticks() + plate.0 / TICK.0
    }

    /// What the last step decided.
    pub fn latest(&self) -> &Step {
        &self.step
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
        self.listen(&applied, &currents);
        let mut limits = self.sense_limits;
        let drives = match &setpoint {
            Setpoint::Off => Some([Volt(0.0); CHANNELS]),
            Setpoint::Drive(drives) => Some(*drives),
            Setpoint::Position(pose) => {
                if *pose != self.target {
                    self.target = *pose;
                    self.is_by_voltage = false;
                    let (target, target_limits) = self.plate.positions(pose);
                    self.target_limits = target_limits;
                    self.path.plan(&target);
                    self.shaper.forget();
                }
                limits = limits.union(self.target_limits);
                self.path.advance();
                None
            }
            Setpoint::Track(pose) => {
                let (positions, pose_limits) = self.plate.positions(pose);
                limits = limits.union(pose_limits);
                let oldest = match self.shaper.oldest() {
                    Some(oldest) => oldest,
                    None => {
                        cold_path();
                        self.is_by_voltage = false;
                        self.target.z = NOWHERE.z;
                        self.shaper.begin(self.path.follow())
                    }
                };
                self.shaper.shape(oldest, &positions, self.path.go_on());
                None
            }
        };
        match drives {
            Some(drives) => self.drive(&drives, limits),
            None => self.go_on(limits),
        }
        let turn = self.turn % CHANNELS;
        let state = &mut self.actuators[turn].heat;
        self.heat.advance_slow(state, &mut self.shared, turn);
        self.turn = (self.turn + 1) % MEMORY_TURNS;
        &self.step
    }

    /// All four actuators to where the path is.
    #[inline(always)]
    fn go_on(&mut self, mut limits: Limits) {
        let positions = self.path.now();
        let turn = self.turn % CHANNELS;
        let state = &mut self.actuators[turn].memory;
        let place = (Micrometre(positions[turn]), self.step.drives[turn]);
        self.memory.advance(state, self.turn / CHANNELS, place);
        // Numbers of all four, in registers.
        let (heat, rails) = (self.heat.clone(), self.rails.clone());
        self.lead::<0>(&heat, &rails, &mut limits);
        self.lead::<1>(&heat, &rails, &mut limits);
        self.lead::<2>(&heat, &rails, &mut limits);
        self.lead::<3>(&heat, &rails, &mut limits);
        self.step.limits = limits;
    }

    /// Actuator `I` to where the path is. A loop would take an eighth of the tick to count.
    #[inline(always)]
    fn lead<const I: usize>(&mut self, heat: &HeatInverse, rails: &Rails, limits: &mut Limits) {
        let actuator = &mut self.actuators[I];
        let mut x = actuator.memory.displacement(Micrometre(self.path.now()[I]));
        if x.0 > self.highest.0 {
            cold_path();
            x = self.highest;
            *limits = limits.union(self.highest_limits);
        }
        let asked = self.calibration.actuators()[I].shape.going_on_straight(x);
        let heater = heat.heater(asked, self.asked[I]);
        self.asked[I] = asked;
        let mut target = self.surroundings.target(I, heater);
        // A target less below rest is driven with nothing, too.
        if target.0 < -UNNOTICED.0 {
            cold_path();
            *limits = limits.union(self.lowest_limits);
            target = Kelvin(0.0);
        }
        let drive = actuator.heat_to(target, heat, rails, limits);
        self.step.drives[I] = drive;
        self.step.codes[I] = actuator.code(drive, rails);
    }

    /// Voltages, and the mirror followed to where they take it.
    fn drive(&mut self, drives: &[Volt; CHANNELS], mut limits: Limits) {
        // One actuator a tick: reading a table forward is slow, and the mirror is slower.
        let turn = self.turn % CHANNELS;
        let shape = &self.calibration.actuators()[turn].shape;
        let displacement = shape.position(self.actuators[turn].rise());
        let seen = self.actuators[turn].memory.position(displacement);
        self.seen[turn] = seen.0;
        self.asked[turn] = self.actuators[turn].rise();
        self.target = NOWHERE;
        self.is_by_voltage = true;
        *self.path.follow() = self.seen;
        self.shaper.forget();
        if !self.is_exchanging() {
            let state = &mut self.actuators[turn].memory;
            let place = (seen, self.step.drives[turn]);
            self.memory.advance(state, self.turn / CHANNELS, place);
        }
        let step = &mut self.step;
        let (heat, rails) = (self.heat.clone(), self.rails.clone());
        for (i, actuator) in self.actuators.iter_mut().enumerate() {
            let drive = actuator.drive(drives[i], &heat, &rails, &mut limits);
            step.drives[i] = drive;
            step.codes[i] = actuator.code(drive, &rails);
        }
        step.limits = limits;
    }
}

/// The displacement at which the first actuator reaches the highest temperature rise, and that limit; where none does within
/// its table the table's top, which limits nothing that the plate lets pass.
fn highest(parts: &Parts) -> (Micrometre, Limits) {
    let rise = parts.bounds.rise;
    let shapes = parts.actuators.iter().map(|actuator| &actuator.shape);
    let reached = shapes.filter(|shape| shape.temperature_rise(shape.top()).0 > rise.0);
    let mut highest = (parts.actuators[0].shape.top(), Limits::NONE);
    for position in reached.map(|shape| shape.position(rise)) {
        highest.1.insert(Limit::TemperatureHigh);
        if position.0 < highest.0.0 {
            highest.0 = position;
        }
    }
    highest
}

/// Turns since that of the round's own actuator: in each round of the four it is another one.
const fn turns_since_own(turn: usize) -> usize {
    let (actuator, round) = (turn % CHANNELS, turn / CHANNELS);
    (actuator + CHANNELS - round) % CHANNELS
}

// The slow lags of one actuator have their turn at every tick, and the surroundings with all of memory.
const _: () = assert!(CHANNELS == TURNS && PERIOD == MEMORY_TURNS);

#[cfg(test)]
mod tests;
