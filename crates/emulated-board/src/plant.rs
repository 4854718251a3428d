//! The plant: electronics and a virtual mirror, answering the board tick by tick.

use std::fs::File;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicU64, Ordering};

use plant_link::{Converters, Pins};
use virtual_mirror::{MirrorConfig, Sensor, VirtualMirror};

use crate::Electronics;
use crate::faults::{Faults, PlantFault, in_vacuum};

/// Length of a control tick.
const TICK_S: f64 = 1e-4;

/// Supply of the output stages.
const SUPPLY_V: f64 = 5.0;

/// What is behind the board's pins.
#[derive(Clone, Debug)]
pub struct Plant {
    electronics: Electronics,
    mirror: VirtualMirror,
    sensor: Sensor,
    /// The same mirror where hardly any heat leaves it, cold until it is needed.
    in_vacuum: VirtualMirror,
    faults: Faults,
    before: Converters,
}

/// Control ticks that have been simulated, readable while the plant runs.
#[derive(Debug, Default)]
pub struct Progress(AtomicU64);

impl Progress {
    /// Simulated time so far.
    pub fn simulated_s(&self) -> f64 {
        self.0.load(Ordering::Relaxed) as f64 * TICK_S
    }
}

impl Plant {
    /// A mirror on a board whose tolerances are drawn from the mirror's seed too.
    ///
    /// # Errors
    /// Where a number of `config` is out of range.
    pub fn new(config: &MirrorConfig) -> Result<Self, virtual_mirror::ConfigError> {
        Ok(Self {
            electronics: Electronics::new(config.seed),
            mirror: VirtualMirror::new(config)?,
            sensor: Sensor::new(config),
            in_vacuum: VirtualMirror::new(&in_vacuum(config))?,
            faults: Faults::default(),
            before: Converters::default(),
        })
    }

    /// What breaks can be chosen here while the plant runs.
    pub(crate) fn faults(&self) -> Faults {
        self.faults.clone()
    }

    /// Answers the board until it closes its end.
    ///
    /// # Errors
    /// Where the link breaks within a tick.
    pub fn run(mut self, mut board: File, mut answer: File, progress: &Progress) -> io::Result<()> {
        let mut bytes = [0; Pins::BYTES];
        loop {
            match board.read_exact(&mut bytes) {
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
                other => other?,
            }
            let pins = Pins::from_bytes(&bytes);
            let drive_v = pins.compare.map(|code| self.electronics.drive_v(code));
            let (fault, is_first) = self.faults.of_this_tick();
            if fault == Some(PlantFault::Vacuum) && is_first {
                std::mem::swap(&mut self.mirror, &mut self.in_vacuum);
            }
            let heated_v = fault.map_or(drive_v, |fault| fault.at_the_heaters(drive_v));
            let mut read = self.convert(pins.tick, drive_v, heated_v, fault);
            if let Some(fault) = fault {
                read = fault.converters(read, &self.before, is_first);
            }
            self.before = read;
            match answer.write_all(&read.to_bytes()) {
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
                other => other?,
            }
            // The board computes its next drives in the meantime.
            self.mirror.step(heated_v, TICK_S);
            self.faults.observe(drive_v, self.mirror.state().hottest_k);
            progress.0.fetch_add(1, Ordering::Relaxed);
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
        self.mirror.step(heated_v, 0.0);
        let state = self.mirror.state();
        let reading = self.sensor.read(&state, TICK_S);
        let current_a = fault.map_or(state.current_a, |fault| {
            fault.currents(drive_v, state.current_a)
        });
        let supply_v = fault.and_then(PlantFault::supply_v).unwrap_or(SUPPLY_V);
        Converters {
            tick,
            current: std::array::from_fn(|i| self.electronics.sense_code(i, current_a[i])),
            sensor_z_nm: (reading.z_um * 1e3).round() as i32,
            supply: self.electronics.supply_code(supply_v),
            upset: plant_link::upset::NONE,
        }
    }
}
