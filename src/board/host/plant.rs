//! The plant link: a call, one a control tick.

extern crate std;

use std::boxed::Box;
use std::time::Instant;

use mirror_protocol::ANSWER_TIMEOUT_MS;
use plant_link::{Converters, Pins, upset};

use super::time;
use crate::board::lockstep::PlantLink;

/// Much less than what the tool waits for an answer, as the link does not answer meanwhile.
const GRACE_MS: u128 = ANSWER_TIMEOUT_MS as u128 / 3;

/// What is on the board: answers the pins of a tick with what the converters read in it.
pub type Plant = Box<dyn FnMut(Pins) -> Converters>;

/// A plant that is called.
pub struct PlantCall {
    plant: Plant,
    grace_since: Instant,
}

impl PlantCall {
    /// With this on the board.
    pub fn new(plant: Plant) -> Self {
        Self {
            plant,
            grace_since: Instant::now(),
        }
    }
}

impl PlantLink for PlantCall {
    const NAME: &'static str = "no board, the firmware on a host";

    fn send(&mut self, _pins: Pins) {}

    /// # Panics
    /// Where the plant disturbs the processor, which this board does not have: the firmware ends, as one that nothing resets.
    fn receive(&mut self, pins: Pins) -> Converters {
        let converters = (self.plant)(pins);
        assert_eq!(converters.upset, upset::NONE, "the processor is disturbed");
        converters
    }

    fn pass(&mut self, ticks: u64) {
        time::advance(ticks);
    }

    /// There is none.
    fn feed_watchdog(&mut self) {}

    fn begin_grace(&mut self) {
        self.grace_since = Instant::now();
    }

    fn is_grace_over(&mut self) -> bool {
        self.grace_since.elapsed().as_millis() > GRACE_MS
    }
}
