//! The plant: electronics with a virtual mirror or known resistors on them, answering the board tick by tick.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use plant_link::{Converters, Pins};
use virtual_mirror::{MirrorConfig, Sensor, State, VirtualMirror};

use crate::controls::{Controls, Surroundings};
use crate::electronics::{Comparators, Electronics, Rail};
use crate::faults::{LATE_TICKS, PlantFault, in_vacuum};
use crate::pace::Pace;

/// Length of a control tick.
const TICK_S: f64 = 1e-4;

/// Supply of the output stages.
const SUPPLY_V: f64 = 5.0;

/// Ticks in which a board that was reset drives nothing, until it has started anew: 10 ms, as the driver board
/// (`hil/tests/silicon.rs`).
const UNDRIVEN_TICKS: u16 = 100;

/// What is behind the board's pins.
#[derive(Clone, Debug)]
pub struct Plant {
    electronics: Electronics,
    rail: Rail,
    comparators: Comparators,
    load: Load,
    controls: Controls,
    before: Converters,
    /// What the position sensor read in the last ticks (nm).
    sensor_past_nm: VecDeque<i32>,
}

/// What is connected to an emulated board.
#[derive(Clone, Debug)]
pub enum Connected {
    /// This mirror, with a position sensor that reads the place under its spot.
    Mirror(Box<MirrorConfig>),
    /// A resistor in the place of each actuator, in ohms: for the current sense's calibration.
    Resistors([f64; 4]),
}

/// The same at work.
#[derive(Clone, Debug)]
pub struct Load(LoadKind);

#[derive(Clone, Debug)]
enum LoadKind {
    Mirror(Box<MirrorLoad>),
    Resistors([f64; 4]),
}

#[derive(Clone, Debug)]
struct MirrorLoad {
    mirror: VirtualMirror,
    sensor: Sensor,
    /// How warm its room is (degC).
    room_c: f64,
    /// The same mirror where hardly any heat leaves it, cold until it is needed.
    in_vacuum: VirtualMirror,
}

impl Surroundings {
    /// How much nearer to the substrate than its centre a plate is under the spot (um).
    fn beside_the_centre_um(&self, state: &State) -> f64 {
        let [x, y] = self.spot_um;
        let slope = |deg: f64| deg.to_radians().tan();
        x * slope(state.tilt_y_deg) + y * slope(state.tilt_x_deg)
    }
}

/// How far the simulation has come, readable while the plant runs.
#[derive(Debug, Default)]
pub struct Progress {
    /// Control ticks that have been simulated.
    ticks: AtomicU64,
    exchanges: AtomicU64,
}

impl Progress {
    /// Simulated time so far.
    pub fn simulated_s(&self) -> f64 {
        self.ticks.load(Ordering::Relaxed) as f64 * TICK_S
    }

    /// Exchanges between board and plant so far.
    pub fn exchanges(&self) -> u64 {
        self.exchanges.load(Ordering::Relaxed)
    }
}

/// A tick under way.
struct Tick {
    read: Converters,
    /// How often the board gets what was read.
    answers: usize,
    drive_v: [f64; 4],
    heated_v: [f64; 4],
}

/// The board that resistors are connected to.
const BENCH_BOARD: u64 = 9;

impl Plant {
    /// What is connected, with this around it, on a board whose tolerances are drawn from the mirror's seed too.
    ///
    /// # Errors
    /// Where a number of a mirror is out of range.
    pub fn new(
        connected: &Connected,
        around: Surroundings,
    ) -> Result<Self, virtual_mirror::ConfigError> {
        Ok(Self {
            electronics: Electronics::new(connected.seed()),
            rail: Rail::default(),
            comparators: Comparators::default(),
            load: Load::new(connected)?,
            controls: Controls::around(around),
            before: Converters::default(),
            sensor_past_nm: VecDeque::new(),
        })
    }

    /// What a person does at the bench while the plant runs.
    pub fn controls(&self) -> Controls {
        self.controls.clone()
    }

    /// Answers the board at this pace until it closes its end.
    ///
    /// # Errors
    /// Where the link breaks within a tick.
    pub(crate) fn run(
        mut self,
        mut board: File,
        mut answer: File,
        mut pace: Pace,
        progress: &Progress,
    ) -> io::Result<()> {
        let mut bytes = [0; Pins::BYTES];
        loop {
            match board.read_exact(&mut bytes) {
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
                other => other?,
            }
            let tick = self.begin(&Pins::from_bytes(&bytes), &mut pace);
            for _ in 0..tick.answers {
                match answer.write_all(&tick.read.to_bytes()) {
                    Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
                    other => other?,
                }
            }
            // The board computes its next drives in the meantime.
            self.end(&tick, progress);
            pace.tick();
        }
    }

    /// A whole tick at these pins, for a board that calls its plant: what the converters read in it.
    pub fn exchange(&mut self, pins: &Pins, pace: &mut Pace, progress: &Progress) -> Converters {
        let tick = self.begin(pins, pace);
        self.end(&tick, progress);
        pace.tick();
        tick.read
    }

    /// A tick from its start to what the converters read.
    fn begin(&mut self, pins: &Pins, pace: &mut Pace) -> Tick {
        let quiet_ticks = match pins.is_idle && self.controls.is_quiet() {
            true => pace.leave_alone(),
            false => 0,
        };
        self.load.advance([0.0; 4], quiet_ticks);
        if pins.tick < self.before.tick {
            self.load.advance([0.0; 4], UNDRIVEN_TICKS);
        }
        self.controls.count_triggers(pins.trigger);
        let (fault, age_ticks) = self.controls.fault_of_this_tick();
        if fault == Some(PlantFault::Vacuum) && age_ticks == 0 {
            self.load.leave_the_air();
        }
        let source_v = fault.map_or(SUPPLY_V, |fault| fault.supply_v(SUPPLY_V, age_ticks));
        let (drive_v, heated_v) = self.drive(pins, fault);
        let passed_s = f64::from(1 + u32::from(quiet_ticks)) * TICK_S;
        self.rail.advance(pins.stages_supplied, source_v, passed_s);
        let mut read = self.convert(pins.tick, drive_v, heated_v, fault);
        read.quiet_ticks = quiet_ticks;
        let sound_nm = read.sensor_z_nm;
        if let Some(fault) = fault {
            read.supply = self.electronics.supply_code(source_v);
            read = fault.converters(read, &self.before, age_ticks);
        }
        self.sensor_past_nm.push_back(sound_nm);
        if self.sensor_past_nm.len() > LATE_TICKS {
            let late_nm = self.sensor_past_nm.pop_front();
            if fault == Some(PlantFault::LateSensor) {
                read.sensor_z_nm = late_nm.unwrap_or(sound_nm);
            }
        }
        self.before = read;
        thread::sleep(fault.map_or(Duration::ZERO, |fault| fault.stall(age_ticks)));
        Tick {
            read,
            answers: fault.map_or(1, |fault| fault.answers(age_ticks)),
            drive_v,
            heated_v,
        }
    }

    /// The rest of the tick, in which the mirror moves.
    fn end(&mut self, tick: &Tick, progress: &Progress) {
        let state = self.load.advance(tick.heated_v, 1);
        let at_the_outputs_v = std::array::from_fn(|i| tick.drive_v[i].max(tick.heated_v[i]));
        self.controls.observe(at_the_outputs_v, &state);
        let ticks = 1 + u64::from(tick.read.quiet_ticks);
        progress.ticks.fetch_add(ticks, Ordering::Relaxed);
        progress.exchanges.fetch_add(1, Ordering::Relaxed);
    }

    /// What the stages drive (V) in a tick with these pins, and what arrives at the heaters, after the comparators.
    fn drive(&mut self, pins: &Pins, fault: Option<PlantFault>) -> ([f64; 4], [f64; 4]) {
        self.comparators.enable(pins.outputs_enabled);
        loop {
            let is_driven = self.comparators.let_drive();
            let told_v = pins.compare.map(|code| match is_driven {
                true => self.electronics.drive_v(code),
                false => 0.0,
            });
            let wanted_v = fault.map_or(told_v, |fault| fault.at_the_heaters(told_v, is_driven));
            let heated_v = self.rail.limit(wanted_v);
            if !self.comparators.disable(heated_v) {
                return (self.rail.limit(told_v), heated_v);
            }
        }
    }

    /// What the converters read at the start of a tick at `drive_v`, of which `heated_v` arrives at the
    /// heaters: the currents follow the drive at once, the mirror has not moved yet.
    fn convert(
        &mut self,
        tick: u32,
        drive_v: [f64; 4],
        heated_v: [f64; 4],
        fault: Option<PlantFault>,
    ) -> Converters {
        let (sound_a, z_um) = self.load.read(heated_v, &self.controls.surroundings());
        let current_a = fault.map_or(sound_a, |fault| fault.currents(drive_v, sound_a));
        Converters {
            tick,
            missed_ticks: 0,
            quiet_ticks: 0,
            current: std::array::from_fn(|i| self.electronics.sense_code(i, current_a[i])),
            sensor_z_nm: (z_um * 1e3).round() as i32,
            supply: self.electronics.supply_code(SUPPLY_V),
            is_over_voltage: self.comparators.have_broken(),
            upset: plant_link::upset::NONE,
        }
    }
}

impl Connected {
    /// What the board's tolerances are drawn from.
    pub fn seed(&self) -> u64 {
        match self {
            Self::Mirror(config) => config.seed,
            Self::Resistors(_) => BENCH_BOARD,
        }
    }
}

impl Load {
    /// What is connected, at rest.
    ///
    /// # Errors
    /// Where a number of a mirror is out of range.
    pub fn new(connected: &Connected) -> Result<Self, virtual_mirror::ConfigError> {
        let kind = match connected {
            Connected::Mirror(config) => LoadKind::Mirror(Box::new(MirrorLoad {
                mirror: VirtualMirror::new(config)?,
                sensor: Sensor::new(config),
                room_c: config.ambient_c,
                in_vacuum: VirtualMirror::new(&in_vacuum(config))?,
            })),
            Connected::Resistors(ohm) => LoadKind::Resistors(*ohm),
        };
        Ok(Self(kind))
    }

    /// The currents at these voltages (A), and what the position sensor reads (um), before anything has moved.
    pub fn read(&mut self, heated_v: [f64; 4], around: &Surroundings) -> ([f64; 4], f64) {
        match &mut self.0 {
            LoadKind::Mirror(mirror) => {
                let rise_k = around.oven_c.map_or(0.0, |oven_c| oven_c - mirror.room_c);
                mirror.mirror.set_ambient(rise_k);
                mirror.mirror.set_air_loss(around.air_factor.unwrap_or(1.0));
                mirror.mirror.set_stage(around.stage_um);
                mirror.mirror.step(heated_v, 0.0);
                let state = mirror.mirror.state();
                let centre_um = mirror.sensor.read(&state, TICK_S).z_um;
                let z_um = centre_um + around.beside_the_centre_um(&state);
                (state.current_a, z_um)
            }
            LoadKind::Resistors(ohm) => (std::array::from_fn(|i| heated_v[i] / ohm[i]), 0.0),
        }
    }

    /// So many ticks of 100 us at these voltages; what is connected after them.
    pub fn advance(&mut self, heated_v: [f64; 4], ticks: u16) -> State {
        match &mut self.0 {
            LoadKind::Mirror(mirror) => {
                mirror.mirror.step(heated_v, f64::from(ticks) * TICK_S);
                mirror.mirror.state()
            }
            LoadKind::Resistors(_) => State::default(),
        }
    }

    /// The mirror is in vacuum from now on, cold.
    pub fn leave_the_air(&mut self) {
        if let LoadKind::Mirror(mirror) = &mut self.0 {
            std::mem::swap(&mut mirror.mirror, &mut mirror.in_vacuum);
        }
    }
}
