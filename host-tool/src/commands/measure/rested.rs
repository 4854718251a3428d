//! Waiting until the mirror is at rest.

use experiments::SETTLING_S;
use quantities::Span;

use super::rest::moved;
use super::sensor::Sensor;
use crate::board::Board;
use crate::error::ToolError;

/// The board's sensor is looked at for so many readings at rest, a millisecond apart.
const NOISE_READINGS: u32 = 100;
const NOISE_PERIOD: Span = Span { s: 1e-3 };

/// While the mirror comes to rest its sensor is looked at so often, every 5 s: in that time what is left of the slowest known heat falls
/// by half.
const LOOKS: u32 = 12;

/// A mirror that came to rest, as the board's own sensor saw it.
pub(crate) struct Rested {
    /// What the sensor read at the end (um); nothing where it is another one.
    read_um: Vec<f64>,
    /// By how much the mirror still moved from the look before to the last one, where that is more than noise (um).
    moves_um: Option<f64>,
}

impl Rested {
    /// Turns all channels off and lets the mirror come to rest: until the board's sensor tells the same twice, and for [`SETTLING_S`] at
    /// most. Of another sensor nobody knows what it reads now, so it takes that long.
    ///
    /// # Errors
    /// Where the board does not answer.
    pub(crate) async fn wait_for(board: &Board, sensor: &Sensor) -> Result<Self, ToolError> {
        let off = board.off().await?;
        let mut rested = Self {
            read_um: Vec::new(),
            moves_um: None,
        };
        if !matches!(sensor, Sensor::Board) {
            board.wait(off.tick, Span { s: SETTLING_S }).await?;
            return Ok(rested);
        }
        rested.read_um = sensor_um(board).await?;
        for look in 1..=LOOKS {
            let s = SETTLING_S * f64::from(look) / f64::from(LOOKS);
            board.wait(off.tick, Span { s }).await?;
            let now_um = sensor_um(board).await?;
            let moved = moved(&rested.read_um, &now_um);
            rested.read_um = now_um;
            rested.moves_um = moved.and_then(|(um, is_still)| (!is_still).then_some(um));
            if moved.is_some_and(|(_, is_still)| is_still) {
                break;
            }
        }
        Ok(rested)
    }

    /// Where the board's sensor stands (um); `None` where it saw nothing, or the sensor is another one.
    pub(super) fn zero_um(self) -> Option<f64> {
        (!self.read_um.is_empty()).then(|| measurement::median(self.read_um))
    }

    /// What is to be said of a mirror that did not come to rest.
    pub(crate) fn unrest(&self) -> Option<String> {
        let moves_um = self.moves_um?;
        let span_s = SETTLING_S / f64::from(LOOKS);
        Some(format!(
            "the mirror still moves, by {moves_um:+.3} um in {span_s:.0} s: it creeps, or the room does not stand still; \
             displacements count from here"
        ))
    }
}

/// What the board's sensor reads for a while, where it reads anything (um).
pub(super) async fn sensor_um(board: &Board) -> Result<Vec<f64>, ToolError> {
    let period = board.period_ticks(NOISE_PERIOD)?;
    let samples = board.samples(period, NOISE_READINGS).await?;
    let read = samples.iter().filter_map(|sample| sample.sensor_z_um);
    Ok(read.map(f64::from).collect())
}
