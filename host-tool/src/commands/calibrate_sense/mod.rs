//! `calibrate-sense`: what the board's current sense is off by, from its zero and from one known resistor.

mod gains;

use std::fmt;
use std::ops::RangeInclusive;

use mirror_protocol::{Drives, Kept, Sense, SenseInfo};
use quantities::{Resistance, Span};
use serde::Serialize;

use self::gains::DRIVES_V;
use crate::board::Board;
use crate::commands::interrupt::Interrupt;
use crate::commands::moving::{check_lease, read_settled};
use crate::commands::status::kept_words;
use crate::error::{BeyondBoard, ToolError};
use crate::report::{self, decimal, row};

/// What flows in these at the voltages below is within the sense's range, and well above its noise.
const RESISTORS_OHM: RangeInclusive<f64> = 300.0..=1000.0;
/// The output filter is long at rest by then.
const SETTLE: Span = Span { s: 0.05 };
/// Settling and reading take a quarter of a second, and on a busy machine, beside a board whose time runs ahead of the wall's, some of
/// them; a tool that dies leaves the drive for the rest.
const LEASE_MS: u32 = 5_000;
/// Readings of 0.1 s that make the zero: it is worth more than a point of the gain.
const ZERO_READINGS: usize = 5;

#[derive(Serialize)]
struct SenseReport {
    before: Sense,
    after: Sense,
    /// With the resistors, at 3 V: what the board read before and reads now, and what flows.
    currents: Option<Currents>,
    kept: Kept,
}

#[derive(Serialize)]
struct Currents {
    before_a: [f64; 4],
    after_a: [f64; 4],
    flows_a: f64,
}

/// What of the gains is asked for.
#[derive(Clone, Copy)]
pub(super) enum Gains {
    /// They stay as they are.
    Kept,
    /// As designed.
    Forgotten,
    /// What such a resistor on each channel tells.
    By(Resistance),
}

/// Finds the zero of each channel; with a known resistor on each, the gain too. Where it fails or is interrupted, the board reads as before.
pub(super) async fn run(board: &Board, asked: Gains, json: bool) -> Result<(), ToolError> {
    if let Gains::By(asked) = asked
        && !RESISTORS_OHM.contains(&asked.ohm)
    {
        return Err(BeyondBoard::Resistor { asked }.into());
    }
    let interrupt = Interrupt::listen()?;
    let before = board.sense().await?.sense;
    let found = interrupt.or(find(board, before, asked)).await;
    board.off().await?;
    let report = match found {
        // What comes after is short, and done whole.
        Ok(found) => found.use_on(board, before).await?,
        Err(ToolError::Interrupted) => return Err(ToolError::InterruptedUnkept { next: "" }),
        Err(error) => return Err(error),
    };
    board.off().await?;
    report::print(&report, json);
    Ok(())
}

/// What was found.
struct FoundSense {
    sense: Sense,
    /// The resistor, and what was read of it at the highest drive before (A).
    read: Option<(Resistance, [f64; 4])>,
}

/// Measures, under `before`, and changes nothing.
async fn find(board: &Board, before: Sense, asked: Gains) -> Result<FoundSense, ToolError> {
    let zeroed = read_zero(board, before).await?;
    let with_gain = |gain| Sense { gain, ..zeroed };
    let resistor = match asked {
        Gains::Kept => return Ok(FoundSense::without_resistor(zeroed)),
        Gains::Forgotten => return Ok(FoundSense::without_resistor(with_gain([1.0; 4]))),
        Gains::By(resistor) => resistor,
    };
    let mut beyond_zero_a = [[0.0; 4]; DRIVES_V.len()];
    let mut last_a = [0.0; 4];
    for (drive_v, beyond_zero_a) in DRIVES_V.into_iter().zip(&mut beyond_zero_a) {
        last_a = driven(board, drive_v).await?;
        let read_a = nominal(&before, last_a);
        *beyond_zero_a = std::array::from_fn(|i| read_a[i] - decimal(zeroed.zero_a[i]));
    }
    Ok(FoundSense {
        sense: with_gain(gains::gains(&beyond_zero_a, resistor)?),
        read: Some((resistor, last_a)),
    })
}

impl FoundSense {
    fn without_resistor(sense: Sense) -> Self {
        Self { sense, read: None }
    }

    /// Has the board read by it.
    async fn use_on(self, board: &Board, before: Sense) -> Result<SenseReport, ToolError> {
        let info = board.set_sense(&self.sense).await?;
        let currents = match self.read {
            None => None,
            Some((resistor, before_a)) => {
                let drive_v = DRIVES_V[DRIVES_V.len() - 1];
                Some(Currents {
                    before_a,
                    after_a: driven(board, drive_v).await?,
                    flows_a: decimal(drive_v) / resistor.ohm,
                })
            }
        };
        Ok(SenseReport {
            before,
            after: info.sense,
            currents,
            kept: info.kept,
        })
    }
}

/// Turns the channels off and has the board take what it reads then for zero. A mirror may be connected.
pub(super) async fn zero(board: &Board) -> Result<SenseInfo, ToolError> {
    let in_use = board.sense().await?.sense;
    board.set_sense(&read_zero(board, in_use).await?).await
}

/// Turns the channels off; `in_use` with what the board reads then for zero.
async fn read_zero(board: &Board, in_use: Sense) -> Result<Sense, ToolError> {
    let commanded = board.off().await?;
    let mut sum_a = [0.0; 4];
    for _ in 0..ZERO_READINGS {
        let (readings, _) = read_settled(board, &commanded, SETTLE).await?;
        let read = nominal(&in_use, readings.current_a);
        sum_a = std::array::from_fn(|i| sum_a[i] + read[i]);
    }
    Ok(Sense {
        zero_a: sum_a.map(|sum| (sum / ZERO_READINGS as f64) as f32),
        ..in_use
    })
}

/// Takes the zero of a board where nobody has: heaters that are hardly driven tell the surroundings by small currents, and an offset of
/// 4 uA, which boards have, is 3 K to them.
pub(super) async fn zero_once(board: &Board) -> Result<(), ToolError> {
    if let Kept::Factory | Kept::FactoryAsStoredIsBad = board.sense().await?.kept {
        zero(board).await?;
    }
    Ok(())
}

/// The currents that are read at `drive_v` on all channels.
pub(super) async fn driven(board: &Board, drive_v: f32) -> Result<[f64; 4], ToolError> {
    let drives = Drives {
        drive_v: [drive_v; 4],
        lease_ms: LEASE_MS,
    };
    let commanded = board.set_drive(drives).await?;
    let (readings, _) = read_settled(board, &commanded, SETTLE).await?;
    check_lease(readings.limits)?;
    Ok(readings.current_a)
}

/// What a board as designed would have read where this one, under `sense`, reads `current_a`.
fn nominal(sense: &Sense, current_a: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| current_a[i] / decimal(sense.gain[i]) + decimal(sense.zero_a[i]))
}

impl fmt::Display for SenseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ua = |amperes: [f32; 4]| row(amperes.map(|zero| decimal(zero) * 1e6), 2, "uA");
        let gain = |gain: [f32; 4]| row(gain.map(decimal), 5, "");
        writeln!(f, "zero       {}  before", ua(self.before.zero_a))?;
        writeln!(f, "           {}  now", ua(self.after.zero_a))?;
        writeln!(f, "gain       {}  before", gain(self.before.gain))?;
        writeln!(f, "           {}  now", gain(self.after.gain))?;
        if let Some(currents) = &self.currents {
            let ma = |amperes: [f64; 4]| row(amperes.map(|current| current * 1e3), 4, "mA");
            writeln!(f, "reads      {}  before", ma(currents.before_a))?;
            writeln!(f, "           {}  now", ma(currents.after_a))?;
            writeln!(f, "flows      {:>9.4} mA in each", currents.flows_a * 1e3)?;
        }
        writeln!(f, "sense      {}", kept_words(self.kept))
    }
}
