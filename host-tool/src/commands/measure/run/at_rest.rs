//! The mirror at rest, as the board's own sensor sees it: its noise, and where displacements count from.

use experiments::SETTLING_S;
use quantities::Span;

use super::Bench;
use crate::commands::measure::rest::{moved, noise_um};
use crate::commands::measure::sensor::Sensor;
use crate::error::ToolError;

/// The sensor's noise is taken from so many readings at rest, a millisecond apart.
const NOISE_READINGS: u32 = 100;
const NOISE_PERIOD: Span = Span { s: 1e-3 };

/// A mirror that cools with the slowest known time constant, 7 s, moves by 20 nm in this time where it is half a micrometre from rest.
const STILL_FOR: Span = Span { s: 0.3 };
/// While the mirror comes to rest its sensor is looked at so often, every 5 s: in that time what is left of the slowest known heat falls
/// by half.
const LOOKS: u32 = 12;

impl Bench<'_> {
    /// The scatter of the board's sensor at rest, one standard deviation, if it has one.
    pub(super) async fn noise_um(&self) -> Result<Option<f64>, ToolError> {
        Ok(noise_um(&self.sensor_um().await?))
    }

    /// What the board's sensor reads for a while, where it reads anything (um).
    async fn sensor_um(&self) -> Result<Vec<f64>, ToolError> {
        let period = self.board.period_ticks(NOISE_PERIOD)?;
        let samples = self.board.samples(period, NOISE_READINGS).await?;
        let read = samples.iter().filter_map(|sample| sample.sensor_z_um);
        Ok(read.map(f64::from).collect())
    }

    /// Lets the mirror come to rest, and displacements count from there: until the board's sensor tells the same twice, and for
    /// [`SETTLING_S`] at most. Of another sensor nobody knows what it reads now, so it takes that long, and displacements count from
    /// the first reading at rest of an experiment.
    pub(crate) async fn count_from_rest(&mut self) -> Result<(), ToolError> {
        let off = self.board.off().await?;
        self.say("letting the mirror come to rest");
        if !matches!(self.sensor, Sensor::Board) {
            return self.rest(off.tick, SETTLING_S).await;
        }
        let mut read = self.sensor_um().await?;
        let mut last = None;
        for look in 1..=LOOKS {
            let rested_s = SETTLING_S * f64::from(look) / f64::from(LOOKS);
            self.rest(off.tick, rested_s).await?;
            let now = self.sensor_um().await?;
            last = moved(&read, &now);
            read = now;
            if last.is_some_and(|(_, is_still)| is_still) {
                break;
            }
        }
        if let Some((moved_um, false)) = last {
            let span_s = SETTLING_S / f64::from(LOOKS);
            self.say(&format!(
                "the mirror still moves, by {moved_um:+.3} um in {span_s:.0} s: it creeps, or the room does not stand still; \
                 displacements count from here"
            ));
        }
        self.zero.um = (!read.is_empty()).then(|| measurement::median(read));
        Ok(())
    }

    /// Lets displacements count from what the board's sensor reads now, where the mirror lies still: the first row of an experiment may be read
    /// when the mirror is on its way already. One that was driven until just now does not lie still.
    pub(super) async fn count_from_here(&mut self) -> Result<(), ToolError> {
        let before = self.sensor_um().await?;
        let tick = self.board.status().await?.telemetry.tick;
        self.board.wait(tick, STILL_FOR).await?;
        let now = self.sensor_um().await?;
        match moved(&before, &now) {
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

    /// Waits with all channels off until so long after a tick, or for Ctrl-C.
    async fn rest(&self, tick: u32, seconds: f64) -> Result<(), ToolError> {
        let rested = self.board.wait(tick, Span { s: seconds });
        self.interrupt.or(rested).await
    }
}
