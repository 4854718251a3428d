//! The mirror at rest, as the board's own sensor sees it: its noise, and where displacements count from.

use quantities::Span;

use super::Bench;
use crate::commands::measure::rest::{moved, noise_um};
use crate::commands::measure::rested::{Rested, sensor_um};
use crate::commands::measure::sensor::Sensor;
use crate::error::ToolError;
use crate::report::decimal;

/// A mirror that cools with the slowest known time constant, 7 s, moves by 20 nm in this time where it is half a micrometre from rest.
const STILL_FOR: Span = Span { s: 0.3 };

impl Bench<'_> {
    /// The scatter of the board's sensor at rest, one standard deviation, if it has one and is the one that is read.
    pub(super) async fn noise_um(&self) -> Result<Option<f64>, ToolError> {
        match self.sensor {
            Sensor::Board => Ok(noise_um(&sensor_um(self.board).await?)),
            Sensor::Serial(_) | Sensor::Recording { .. } => Ok(None),
        }
    }

    /// Lets the mirror come to rest, and displacements count from there: where the sensor is not the board's, from the first reading at rest
    /// of an experiment.
    pub(crate) async fn count_from_rest(&mut self) -> Result<(), ToolError> {
        self.say("letting the mirror come to rest");
        let rested = Rested::wait_for(self.board, &self.sensor);
        let rested = self.interrupt.or(rested).await?;
        if let Some(unrest) = rested.unrest() {
            self.say(&unrest);
        }
        if matches!(self.sensor, Sensor::Board) {
            self.zero.um = rested.zero_um();
        }
        Ok(())
    }

    /// Lets displacements count from what the board's sensor reads now, where the mirror lies still since it read what it did `before`: the first
    /// row of an experiment may be read when the mirror is on its way already. One that was driven until just now does not lie still.
    pub(super) async fn count_from_here(&mut self, before: &[f64]) -> Result<(), ToolError> {
        let tick = self.board.status().await?.telemetry.tick;
        self.board.wait(tick, STILL_FOR).await?;
        let now = sensor_um(self.board).await?;
        match moved(before, &now) {
            Some((_, true)) => {
                self.zero.um = Some(measurement::median(now));
                // Now, for it fades.
                let status = self.board.status().await?;
                self.zero.remembered_um = decimal(status.telemetry.pose.z_um);
            }
            Some((_, false)) => {
                self.zero.begin(true);
                self.say(
                    "the mirror is on its way to rest: displacements count from the sensor's own zero, not from here",
                );
            }
            None => {}
        }
        Ok(())
    }
}
