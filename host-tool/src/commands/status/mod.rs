//! `status`: who the board is and what it is doing. `clear`: the same once its faults are forgotten.

mod report;

use std::fmt;

use serde::Serialize;

use self::report::StatusReport;
use crate::board::{Board, Found, Owner, Seen};
use crate::commands::moving::check_states;
use crate::error::ToolError;
use crate::report::print;

pub(crate) use self::report::kept_words;
pub(super) use self::report::{calibrated_words, uncertainty_k};

/// Lets the board forget its faults, and shows what it does then.
///
/// # Errors
/// Where it trips again: it checks its heaters before it says that it has forgotten.
pub(super) async fn clear(board: &Board, json: bool) -> Result<(), ToolError> {
    board.clear().await?;
    let report = StatusReport::read(board, false).await?;
    let states = board.status().await?.telemetry.states;
    print(&report, json);
    match check_states(&states) {
        Err(ToolError::Tripped { channel, fault }) => {
            Err(ToolError::TrippedAgain { channel, fault })
        }
        checked => checked,
    }
}

/// What can be known of a board that another process has, who does not answer.
#[derive(Serialize)]
struct InUse<'a> {
    board: &'a Found,
    /// Who has it.
    owner: Owner,
}

impl fmt::Display for InUse<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "board      {}", self.board.name)?;
        writeln!(f, "owner      {}", self.owner)
    }
}

/// Shows the board's status, through who has it where that is another process; or who that is, where it does not answer.
pub(super) async fn look(found: &Found, history: bool, json: bool) -> Result<(), ToolError> {
    let seen = Board::look(found).await?;
    if let Seen::InUse(owner) = &seen {
        let (board, owner) = (found, owner.clone());
        print(&InUse { board, owner }, json);
    }
    let mut report = StatusReport::read(seen.view(found)?, history).await?;
    report.is_in_use = seen.owner().is_some();
    report.owner = match &seen {
        Seen::Open(board) => board.waited_for().cloned(),
        _ => seen.owner().cloned(),
    };
    print(&report, json);
    Ok(())
}
