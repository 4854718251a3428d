//! The plant link: two FIFOs through semihosting, blocking, one exchange a control tick.

use core::sync::atomic::Ordering;

use plant_link::{Converters, FROM_PLANT, Pins, TO_PLANT};
use semihosting::fs::File;
use semihosting::io::{self, Read, Write};

use super::grace::Grace;
use super::{exit, time, upset, watchdog};
use crate::board::lockstep::PlantLink;

/// The FIFOs.
pub struct PlantFifos {
    to_plant: File,
    from_plant: File,
    grace: Grace,
}

impl PlantFifos {
    /// Opens the link.
    ///
    /// # Errors
    /// Where the emulator was started without a plant, or the link is already open.
    pub fn open() -> io::Result<Self> {
        // The other end opens in the same order; opening a FIFO waits for it.
        let to_plant = File::create(TO_PLANT)?;
        let from_plant = File::open(FROM_PLANT)?;
        let grace = Grace::take().ok_or(io::ErrorKind::AlreadyExists)?;
        exit::HAS_PLANT.store(true, Ordering::Relaxed);
        Ok(Self {
            to_plant,
            from_plant,
            grace,
        })
    }

    /// What answers these pins. A reset can have left behind an answer to others.
    fn answer(&mut self, pins: Pins) -> io::Result<Converters> {
        loop {
            let mut bytes = [0; Converters::BYTES];
            self.from_plant.read_exact(&mut bytes)?;
            let converters = Converters::from_bytes(&bytes);
            if converters.tick == pins.tick {
                return Ok(converters);
            }
        }
    }
}

impl PlantLink for PlantFifos {
    const NAME: &'static str = "emulated MPS2-AN386 with a virtual mirror";

    fn send(&mut self, pins: Pins) {
        if self.to_plant.write_all(&pins.to_bytes()).is_err() {
            exit::plant_lost();
        }
    }

    fn receive(&mut self, pins: Pins) -> Converters {
        let Ok(converters) = self.answer(pins) else {
            exit::plant_lost()
        };
        upset::suffer(converters.upset);
        converters
    }

    fn pass(&mut self, ticks: u64) {
        time::advance(ticks);
    }

    fn feed_watchdog(&mut self) {
        watchdog::feed();
    }

    fn begin_grace(&mut self) {
        self.grace.begin();
    }

    fn is_grace_over(&mut self) -> bool {
        self.grace.is_over()
    }
}
