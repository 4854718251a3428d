//! The mirror at rest, as the board's own sensor sees it: its noise, and where displacements count from.

use mirror_protocol::Drives;
use quantities::Span;

use super::{Bench, LEASE_MS, attended, whole};
use crate::commands::measure::rest::{moved, noise_um};
use crate::commands::measure::rested::{Rested, sensor_um};
use crate::commands::measure::sensor::Sensor;
use crate::error::ToolError;

/// A mirror that cools with the slowest known time constant, 7 s, moves by 20 nm in this time where it is half a micrometre from rest.
const STILL_FOR: Span = Span { s: 0.3 };
/// As long as a sweep stays at its top.
const AT_THE_TOP: Span = Span { s: 1.0 };

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
            self.note_rest(self.zero.um);
        }
        Ok(())
    }

    /// Drives the mirror all the way up and turns it off, so that it comes to rest from where every experiment lets it come from. An
    /// interrupted one ends with the channels off.
    pub(crate) async fn go_over_the_range(&mut self, max_v: f64) -> Result<(), ToolError> {
        let board = self.board;
        let going = async {
            let drives = Drives {
                drive_v: [max_v as f32; 4],
                lease_ms: LEASE_MS,
            };
            let driven = board.set_drive(drives).await?;
            board.wait(driven.tick, AT_THE_TOP).await
        };
        self.has_driven = true;
        let ended = attended(board, &self.interrupt, going).await;
        board.off().await?;
        whole(ended)
    }

    /// The mirror rests there. The first such place to which a way has led counts: one that has had none may be another.
    pub(super) fn note_rest(&mut self, um: Option<f64>) {
        if self.has_driven {
            self.rest_um = self.rest_um.or(um);
        }
    }

    /// By how much the mirror at rest has moved since it first came back from its way, as the board's sensor sees it (um). `None` without
    /// such a sensor.
    pub(crate) async fn rest_moved_um(&self) -> Result<Option<f64>, ToolError> {
        let Some(from_um) = self.rest_um else {
            return Ok(None);
        };
        let rested = Rested::wait_for(self.board, &self.sensor);
        let rested = self.interrupt.or(rested).await?;
        Ok(rested.zero_um().map(|um| um - from_um))
    }

    /// Lets displacements count from what the board's sensor reads now, where the mirror lies still since it read what it did `before`: the first
    /// row of an experiment may be read when the mirror is on its way already. One that was driven until just now does not lie still.
    pub(super) async fn count_from_here(&mut self, before: &[f64]) -> Result<(), ToolError> {
        let tick = self.board.status().await?.telemetry.tick;
        self.board.wait(tick, STILL_FOR).await?;
        let now = sensor_um(self.board).await?;
        match moved(before, &now) {
            Some((_, true)) => self.zero.um = Some(measurement::median(now)),
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
