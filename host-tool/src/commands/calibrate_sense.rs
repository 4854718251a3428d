//! `calibrate-sense`: what the board's current sense is off by, from its zero and from one known resistor.

use std::fmt;
use std::ops::RangeInclusive;

use mirror_protocol::{Drives, Kept, Sense};
use quantities::{Resistance, Span};
use serde::Serialize;

use crate::board::Board;
use crate::commands::interrupt::Interrupt;
use crate::commands::moving::{check_lease, read_settled};
use crate::commands::status::kept_words;
use crate::error::{BeyondBoard, ToolError};
use crate::report::{self, decimal, row};

/// What flows in these at the voltages below is within the sense's range, and well above its noise.
const RESISTORS_OHM: RangeInclusive<f64> = 300.0..=1000.0;
/// Voltages at which the gain is read, up to 6 mA in 499 ohm. The zero is known by then.
const DRIVES_V: [f32; 3] = [1.0, 2.0, 3.0];
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

/// Finds the zero of each channel; with a known resistor on each, the gain too. Where it is interrupted, the board reads as before.
pub(super) async fn run(
    board: &Board,
    resistor: Option<Resistance>,
    json: bool,
) -> Result<(), ToolError> {
    if let Some(asked) = resistor.filter(|asked| !RESISTORS_OHM.contains(&asked.ohm)) {
        return Err(BeyondBoard::Resistor { asked }.into());
    }
    let interrupt = Interrupt::listen()?;
    let before = board.sense().await?.sense;
    let found = interrupt.or(find(board, before, resistor)).await;
    if matches!(found, Err(ToolError::Interrupted)) {
        // By this the channels are off, too.
        board.set_sense(&before).await?;
        return Err(ToolError::InterruptedUnkept { next: "" });
    }
    let report = found?;
    board.off().await?;
    report::print(&report, json);
    Ok(())
}

async fn find(
    board: &Board,
    before: Sense,
    resistor: Option<Resistance>,
) -> Result<SenseReport, ToolError> {
    let zeroed = zero(board).await?;
    let Some(resistor) = resistor else {
        return Ok(SenseReport {
            before,
            after: zeroed.sense,
            currents: None,
            kept: zeroed.kept,
        });
    };
    let mut read = Vec::new();
    for drive_v in DRIVES_V {
        read.push(nominal(&zeroed.sense, driven(board, drive_v).await?));
    }
    let gain = std::array::from_fn(|i| {
        let beyond_zero = |k: usize| read[k][i] - decimal(zeroed.sense.zero_a[i]);
        let flows = |k: usize| decimal(DRIVES_V[k]) / resistor.ohm;
        let sum = |of: &dyn Fn(usize) -> f64| (0..DRIVES_V.len()).map(of).sum::<f64>();
        let gain = sum(&|k| flows(k) * beyond_zero(k)) / sum(&|k| beyond_zero(k).powi(2));
        gain as f32
    });
    let sense = Sense {
        gain,
        ..zeroed.sense
    };
    let info = board.set_sense(&sense).await?;
    let top = DRIVES_V.len() - 1;
    let as_before = |i: usize| (read[top][i] - decimal(before.zero_a[i])) * decimal(before.gain[i]);
    Ok(SenseReport {
        before,
        after: info.sense,
        currents: Some(Currents {
            before_a: std::array::from_fn(as_before),
            after_a: driven(board, DRIVES_V[top]).await?,
            flows_a: decimal(DRIVES_V[top]) / resistor.ohm,
        }),
        kept: info.kept,
    })
}

/// Turns the channels off and has the board take what it reads then for zero. A mirror may be connected.
pub(super) async fn zero(board: &Board) -> Result<mirror_protocol::SenseInfo, ToolError> {
    let in_use = board.sense().await?.sense;
    let commanded = board.off().await?;
    let mut sum_a = [0.0; 4];
    for _ in 0..ZERO_READINGS {
        let (readings, _) = read_settled(board, &commanded, SETTLE).await?;
        let read = nominal(&in_use, readings.current_a);
        sum_a = std::array::from_fn(|i| sum_a[i] + read[i]);
    }
    let sense = Sense {
        zero_a: sum_a.map(|sum| (sum / ZERO_READINGS as f64) as f32),
        ..in_use
    };
    board.set_sense(&sense).await
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
        if let Some(currents) = &self.currents {
            let ma = |amperes: [f64; 4]| row(amperes.map(|current| current * 1e3), 4, "mA");
            writeln!(f, "gain       {}  before", gain(self.before.gain))?;
            writeln!(f, "           {}  now", gain(self.after.gain))?;
            writeln!(f, "reads      {}  before", ma(currents.before_a))?;
            writeln!(f, "           {}  now", ma(currents.after_a))?;
            writeln!(f, "flows      {:>9.4} mA in each", currents.flows_a * 1e3)?;
        }
        writeln!(f, "sense      {}", kept_words(self.kept))
    }
}
