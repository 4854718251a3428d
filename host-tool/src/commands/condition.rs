//! `condition`: over the whole range and back, so that the board knows what the mirror remembers.
//!
//! Friction holds a mirror where its way has left it, and a board that has just started knows nothing of that way. Whatever it was, after
//! the highest position and the lowest one friction holds it as the board expects.

use std::fmt;

use mirror_protocol::{Position, Status};
use quantities::{Hold, Span};
use serde::Serialize;

use crate::board::{Board, level_um};
use crate::commands::moving::{Move, Pace};
use crate::commands::uncertainty::Uncertainty;
use crate::error::ToolError;
use crate::names::{limit_names, limited_line};
use crate::report;

/// How long it stays at either end: ten of the slowest time constants that move a mirror quickly.
const STAY: Span = Span { s: 1.0 };

#[derive(Serialize)]
struct Condition {
    /// The highest and the lowest position, in the order in which it went there.
    went_to_um: [f64; 2],
    /// How far a position may be off by what the board knew before, and by what it knows now; `None` where the calibration does
    /// not say what it leaves.
    uncertainty_before_um: Option<f64>,
    uncertainty_um: Option<f64>,
    limited_by: Vec<&'static str>,
}

pub(super) async fn run(board: &Board, longest: Hold, json: bool) -> Result<(), ToolError> {
    let pace = Pace::new(STAY, Some(Hold::For(STAY)), longest)?;
    let (lowest_um, top_um) = level_um(&board.status().await?);
    let went_to_um = [top_um, lowest_um];
    go(board, lowest_um, pace).await?;
    let before = told(&board.status().await?);
    for z_um in went_to_um {
        go(board, z_um, pace).await?;
    }
    let status = board.status().await?;
    board.off().await?;
    let report = Condition {
        went_to_um,
        uncertainty_before_um: before,
        uncertainty_um: told(&status),
        limited_by: limit_names(status.health.limits_since_command),
    };
    report::print(&report, json);
    Ok(())
}

fn told(status: &Status) -> Option<f64> {
    let told = Uncertainty::from(&status.telemetry).once_there();
    told.map(|(z_um, _)| z_um)
}

/// To a position, and stays there. Who interrupts it is told that the board drives on.
async fn go(board: &Board, z_um: f64, pace: Pace) -> Result<(), ToolError> {
    let position = Position {
        z_um: z_um as f32,
        lease_ms: pace.lease_ms(),
    };
    let moving = Move::begin(board, pace, &board.status().await?)?;
    let commanded = moving.answered(board.set_position(position)).await?;
    moving.settle_and_read(&commanded).await.map(drop)
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [top_um, lowest_um] = self.went_to_um;
        writeln!(
            f,
            "went to    {top_um:>9.3} um, and back to {lowest_um:.3} um"
        )?;
        if let (Some(before_um), Some(um)) = (self.uncertainty_before_um, self.uncertainty_um) {
            writeln!(
                f,
                "uncertain  {um:>9.3} um either way in 95 of 100 cases at the lowest position; {before_um:.3} um before"
            )?;
            if um > before_um {
                writeln!(
                    f,
                    "           more than before it went up: it still creeps and cools back from there, which passes in some minutes"
                )?;
            }
        }
        writeln!(f, "{}", limited_line(&self.limited_by))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_what_it_has_gained() {
        let mut report = Condition {
            went_to_um: [165.2, 0.0],
            uncertainty_before_um: Some(0.9214),
            uncertainty_um: Some(0.0931),
            limited_by: vec![],
        };
        assert_eq!(
            report.to_string(),
            "went to      165.200 um, and back to 0.000 um\n\
             uncertain      0.093 um either way in 95 of 100 cases at the lowest position; 0.921 um before\n\
             limited    by nothing\n"
        );
        report.uncertainty_um = Some(1.2);
        assert!(
            report
                .to_string()
                .contains("it still creeps and cools back from there")
        );
        report.uncertainty_um = None;
        assert!(!report.to_string().contains("uncertain"));
    }
}
